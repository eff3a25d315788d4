"""How a pose camera_T_parent is written as three numbers of translation and three of rotation.

Each class turns the numbers into the pose, and the derivative of a loss by a left perturbation [phi, rho] of the
pose into one by the numbers.
"""

from __future__ import annotations

from math import factorial
from typing import Protocol

import numpy as np

from hecbench import se3
from hecbench.se3 import Array
from hecbench_plugins.first_order import kernels

_SERIES = 24


class PoseNumbers(Protocol):
    """A parametrisation; `start` (2, 3) holds its translation and rotation numbers at the start."""

    start: Array

    def pose(self, translation: Array, rotation: Array) -> Array:
        """camera_T_parent (4, 4)."""
        ...

    def pull(self, translation: Array, rotation: Array, slope: Array) -> tuple[Array, Array]:
        """The loss's derivatives (3,) and (3,) from `slope` (6,), by a left perturbation."""
        ...


class Increment:
    """``[Exp(w) R0, t0 + dt]``: an increment of the start, turning about the parent's origin.

    It has no singular start, as Euler angles have where a camera looks back at the robot.
    """

    def __init__(self, start: Array) -> None:
        self.start = np.zeros((2, 3))
        self._camera_T_parent = start

    def pose(self, translation: Array, rotation: Array) -> Array:
        """See `PoseNumbers`."""
        turned = _exponential(rotation)[0] @ self._camera_T_parent[:3, :3]
        return _transform(turned, self._camera_T_parent[:3, 3] + translation)

    def pull(self, translation: Array, rotation: Array, slope: Array) -> tuple[Array, Array]:
        """See `PoseNumbers`."""
        turn = _about_origin(slope, self._camera_T_parent[:3, 3] + translation)
        return slope[3:], _exponential(rotation)[1].T @ turn


class LogVector:
    """EasyHeC's: the logarithm of the pose in se(3), R = Exp(w), t = V(w) u; u is the translation's part."""

    def __init__(self, start: Array) -> None:
        w, u = np.split(se3.log(start), 2)
        self.start = np.stack([u, w])

    def pose(self, translation: Array, rotation: Array) -> Array:
        """See `PoseNumbers`."""
        R, V = _exponential(rotation)
        return _transform(R, V @ translation)

    def pull(self, translation: Array, rotation: Array, slope: Array) -> tuple[Array, Array]:
        """See `PoseNumbers`."""
        turn, shift = np.split(_left_jacobian(np.concatenate([rotation, translation])).T @ slope, 2)
        return shift, turn


class EulerAngles:
    """DRHeC's: t and three absolute angles. Their order is not published: here R = Rx(a) Ry(b) Rz(c)."""

    def __init__(self, start: Array) -> None:
        R = start[:3, :3]
        angles = [
            np.arctan2(-R[1, 2], R[2, 2]),
            np.arcsin(np.clip(R[0, 2], -1, 1)),
            np.arctan2(-R[0, 1], R[0, 0]),
        ]
        self.start = np.stack([start[:3, 3], angles])

    def pose(self, translation: Array, rotation: Array) -> Array:
        """See `PoseNumbers`."""
        a, b, c = self._turns(rotation)
        return _transform(a @ b @ c, translation)

    def pull(self, translation: Array, rotation: Array, slope: Array) -> tuple[Array, Array]:
        """See `PoseNumbers`."""
        a, b, _ = self._turns(rotation)
        axes = np.array([[1.0, 0, 0], a[:, 1], (a @ b)[:, 2]])
        return slope[3:], axes @ _about_origin(slope, translation)

    def _turns(self, rotation: Array) -> list[Array]:
        return [_exponential(about)[0] for about in np.diag(rotation)]


def _transform(rotation: Array, translation: Array) -> Array:
    """One transform (4, 4), as `se3.make` does, without its care for leading axes."""
    a_T_b = np.eye(4)
    a_T_b[:3, :3], a_T_b[:3, 3] = rotation, translation
    return a_T_b


def _about_origin(slope: Array, origin: Array) -> Array:
    """The slope (3,) by a turn about the parent's origin, which stays in its place: phi's minus origin x rho's."""
    (x, y, z), (u, v, w) = origin, slope[3:]
    return np.asarray(slope[:3] - np.array([y * w - z * v, z * u - x * w, x * v - y * u]))


def _exponential(rotvec: Array) -> tuple[Array, Array]:
    """Exp(w) and V(w), both (3, 3)."""
    rotation, jacobian = np.empty((3, 3)), np.empty((3, 3))
    kernels.exponential(rotvec, rotation, jacobian)
    return rotation, jacobian


def _left_jacobian(twist: Array) -> Array:
    """J (6, 6) with exp(xi + d) = exp(J d) exp(xi): the sum of ad(xi)^k / (k + 1)! (Barfoot 2017, eq. 7.83)."""
    ad = np.zeros((6, 6))
    ad[:3, :3] = ad[3:, 3:] = se3.hat(twist[:3])
    ad[3:, :3] = se3.hat(twist[3:])
    term, total = np.eye(6), np.eye(6)
    for k in range(1, _SERIES):
        term = term @ ad
        total += term / factorial(k + 1)
    return total
