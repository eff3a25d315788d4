"""One camera of the answers of many views."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hecbench import se3
from hecbench.se3 import Array

_ROUNDS, _CONVERGED_RAD, _LEAST_RAD = 100, 1e-9, 1e-9
_MAD = 1.4826
"""Of a normal distribution: its deviation over its median absolute deviation."""
_MEDIAN_VARIANCE = np.pi / 2
"""Of a median of n normal numbers, over that of their mean."""
SHARED_VARIANCE = 1.0
"""Of the error that all views of a camera share, over the variance of one view. Measured on six recordings of the
virtual lab, of a seed that no figure is of: about 0.6 for rotations, 1.4 for places."""


@dataclass(frozen=True, eq=False)
class Combined:
    """What N views say together.

    Attributes:
        parent_T_camera: (4, 4) m.
        covariance: (6, 6) of [phi rad, rho m] in ``X_true = exp([phi, rho]) @ X``; None for fewer than two views.
        spread_m, spread_rad: deviation of one view's place, along one axis, and of its rotation, about one axis.
    """

    parent_T_camera: Array
    covariance: Array | None
    spread_m: float
    spread_rad: float


def combined(parent_T_camera: ArrayLike) -> Combined:
    """The median along each axis of the places, and the rotation of the least sum of angles, of poses (N, 4, 4).

    The deviations are those that the views' median distances from the answer have in a normal distribution.
    """
    poses = np.asarray(parent_T_camera, float)
    place, R = np.median(poses[:, :3, 3], 0), l1_mean(poses[:, :3, :3])
    found = se3.make(R, place)
    apart = np.abs(poses[:, :3, 3] - place)
    turned = np.abs(se3.so3_log(poses[:, :3, :3] @ R.T))
    n = len(poses)
    spread_m, spread_rad = (_MAD * float(np.sqrt((np.median(a, 0) ** 2).mean())) for a in (apart, turned))
    if n < 2:
        return Combined(found, None, 0.0, 0.0)
    of_twist = np.eye(6)
    of_twist[3:, :3] = se3.hat(place)  # a turn about the parent's origin moves the camera, too
    variance = np.repeat([spread_rad**2, spread_m**2], 3) * (_MEDIAN_VARIANCE / n + SHARED_VARIANCE)
    return Combined(found, of_twist * variance @ of_twist.T, spread_m, spread_rad)


def l1_mean(rotations: ArrayLike) -> Array:
    """R (3, 3) of the least sum of angles to rotations (N, 3, 3).

    Weiszfeld's rounds, after Hartley, Aftab and Trumpf 2011, "L1 rotation averaging using the Weiszfeld algorithm".
    """
    rotations = np.asarray(rotations, float)
    R = _medoid(rotations)
    for _ in range(_ROUNDS):
        turns = se3.so3_log(rotations @ R.T)
        weight = 1 / np.maximum(np.linalg.norm(turns, axis=1), _LEAST_RAD)
        step = weight @ turns / weight.sum()
        R = se3.so3_exp(step) @ R
        if np.linalg.norm(step) < _CONVERGED_RAD:
            break
    return np.asarray(se3.nearest_rotation(R))


def _medoid(rotations: Array) -> Array:
    """The one of rotations (N, 3, 3) from which the others are nearest."""
    cosine = np.einsum("iab,jab->ij", rotations, rotations)
    angle = np.arccos(np.clip((cosine - 1) / 2, -1, 1))
    return np.asarray(rotations[angle.sum(1).argmin()])
