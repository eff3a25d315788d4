"""Forward and inverse kinematics of the Universal Robots e-series, nominal lengths, closed form.

Lengths: Universal Robots, "DH parameters for calculations of kinematics and dynamics". The inverse follows
the geometry of Hawkins 2013, "Analytic inverse kinematics for the Universal Robots UR-5/UR-10 arms", with
the wrist taken by atan2 from rotation entries alone, which stays accurate at its singularity.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import asin, atan2, cos, hypot, pi, sin, sqrt
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from hecbench.errors import InputError
from hecbench.se3 import Array

JOINT_NAMES = (
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
)

_ALPHA = np.array([pi / 2, 0.0, 0.0, pi / 2, -pi / 2, 0.0])
_COS_ALPHA, _SIN_ALPHA = np.round(np.cos(_ALPHA)), np.round(np.sin(_ALPHA))
_REACH_TOLERANCE = 1e-10
_WRIST_SINGULAR = 1e-9


class Arm(Protocol):
    """The kinematics of an arm with six revolute joints. `base` and `flange` are the frames of its driver."""

    @property
    def name(self) -> str:
        """Of the model."""
        ...

    def link_frames(self, joints_rad: ArrayLike) -> Array:
        """base_T_link (..., 6, 4, 4) after each joint, for joints (..., 6) rad; the last is base_T_flange."""
        ...

    def forward(self, joints_rad: ArrayLike) -> Array:
        """base_T_flange (..., 4, 4) of joints (..., 6) rad."""
        ...

    def inverse(self, base_T_flange: ArrayLike, near_rad: ArrayLike | None = None) -> Array:
        """Joint solutions (K, 6) rad of a flange pose (4, 4), nearest to `near_rad` (6,) first; none: out of reach."""
        ...


@dataclass(frozen=True)
class UrArm:
    """One arm of the e-series. Frames: `base` is the controller's base, `flange` its tool flange (tool0)."""

    name: str
    a_m: tuple[float, float]
    """Lengths of upper arm and forearm, negative as in the maker's table."""
    d_m: tuple[float, float, float, float]
    """d1, d4, d5, d6."""
    joint_range_rad: float = 2 * pi
    """Every joint turns from minus to plus this angle."""

    def link_frames(self, joints_rad: ArrayLike) -> Array:
        """base_T_link (..., 6, 4, 4) after each joint, for joints (..., 6) rad; the last is base_T_flange."""
        joints = np.asarray(joints_rad, float)
        c, s = np.cos(joints), np.sin(joints)
        a = np.array([0.0, *self.a_m, 0.0, 0.0, 0.0])
        d = np.array([self.d_m[0], 0.0, 0.0, *self.d_m[1:]])
        frames = np.zeros((*joints.shape, 4, 4))
        frames[..., 0, 0], frames[..., 0, 1], frames[..., 0, 2] = c, -s * _COS_ALPHA, s * _SIN_ALPHA
        frames[..., 1, 0], frames[..., 1, 1], frames[..., 1, 2] = s, c * _COS_ALPHA, -c * _SIN_ALPHA
        frames[..., 2, 1], frames[..., 2, 2] = _SIN_ALPHA, _COS_ALPHA
        frames[..., 0, 3], frames[..., 1, 3], frames[..., 2, 3] = a * c, a * s, d
        frames[..., 3, 3] = 1.0
        for i in range(1, 6):
            frames[..., i, :, :] = frames[..., i - 1, :, :] @ frames[..., i, :, :]
        return frames

    def forward(self, joints_rad: ArrayLike) -> Array:
        """base_T_flange (..., 4, 4) of joints (..., 6) rad."""
        return np.asarray(self.link_frames(joints_rad)[..., 5, :, :])

    def inverse(self, base_T_flange: ArrayLike, near_rad: ArrayLike | None = None) -> Array:
        """All joint solutions (K, 6) rad, K <= 8, of a flange pose (4, 4); no row when it is out of reach.

        Angles lie in (-pi, pi]. With `near_rad` (6,) every angle is turned by full turns to the value nearest
        to it within the joint range, wrist 3 keeps its value where it is free (wrist singularity), and the
        rows are sorted by their largest joint step from there.
        """
        target = np.asarray(base_T_flange, float)
        near = None if near_rad is None else np.asarray(near_rad, float)
        free_wrist_3 = 0.0 if near is None else float(near[5])
        rows = [
            row
            for shoulder, wrist in product((1, -1), (1, -1))
            for row in self._branch(target, shoulder, wrist, free_wrist_3)
        ]
        solutions = wrap(np.array(rows).reshape(-1, 6))
        if near is None:
            return solutions
        turned = solutions + 2 * pi * np.round((near - solutions) / (2 * pi))
        turned -= 2 * pi * np.sign(turned) * (np.abs(turned) > self.joint_range_rad)
        return np.asarray(turned[np.argsort(np.abs(turned - near).max(axis=1), kind="stable")])

    def _branch(self, target: Array, shoulder: int, wrist: int, free_wrist_3: float) -> list[list[float]]:
        """The two elbow solutions of one shoulder and wrist sign; none when out of reach."""
        (a2, a3), (d1, d4, d5, d6) = self.a_m, self.d_m
        (r00, r01, r02, px), (r10, r11, r12, py), (r20, r21, r22, pz), _ = target.tolist()
        wx, wy = px - d6 * r02, py - d6 * r12  # origin of link 5
        offset = d4 / max(hypot(wx, wy), 1e-12)
        if offset > 1 + _REACH_TOLERANCE:
            return []
        lift = asin(min(offset, 1.0))
        q1 = atan2(wy, wx) + (lift if shoulder > 0 else pi - lift)
        c1, s1 = cos(q1), sin(q1)
        along_x, along_y, c5 = (r00 * s1 - r10 * c1), (r01 * s1 - r11 * c1), (r02 * s1 - r12 * c1)
        s5 = wrist * hypot(along_x, along_y)
        q5 = atan2(s5, c5)
        q6 = free_wrist_3 if abs(s5) < _WRIST_SINGULAR else atan2(-along_y * wrist, along_x * wrist)
        c6, s6 = cos(q6), sin(q6)
        # link 5: x5 = c6 x6 - s6 y6, y5 = s6 x6 + c6 y6, z5 = z6; link 4: x4 = c5 x5 - s5 z5, z4 = -y5
        x5x, x5y, x5z = c6 * r00 - s6 * r01, c6 * r10 - s6 * r11, c6 * r20 - s6 * r21
        z4x, z4y, z4z = -(s6 * r00 + c6 * r01), -(s6 * r10 + c6 * r11), -(s6 * r20 + c6 * r21)
        sin5, cos5 = sin(q5), cos(q5)
        x4x, x4y, x4z = cos5 * x5x - sin5 * r02, cos5 * x5y - sin5 * r12, cos5 * x5z - sin5 * r22
        # origin of link 4 in the plane of upper arm and forearm (axes: (c1, s1, 0) and the vertical)
        u = (wx - d5 * z4x) * c1 + (wy - d5 * z4y) * s1
        v = pz - d6 * r22 - d5 * z4z - d1
        q234 = atan2(x4z, x4x * c1 + x4y * s1)
        c3 = (u * u + v * v - a2 * a2 - a3 * a3) / (2 * a2 * a3)
        if abs(c3) > 1 + _REACH_TOLERANCE:
            return []
        c3 = min(max(c3, -1.0), 1.0)
        rows = []
        for s3 in (sqrt(1 - c3 * c3), -sqrt(1 - c3 * c3)):
            q2 = atan2(v, u) - atan2(a3 * s3, a2 + a3 * c3)
            q3 = atan2(s3, c3)
            rows.append([q1, q2, q3, q234 - q2 - q3, q5, q6])
        return rows


def wrap(angles_rad: ArrayLike) -> Array:
    """Angles of any shape in (-pi, pi]."""
    angles = np.asarray(angles_rad, float)
    return np.asarray(angles - 2 * pi * np.ceil((angles - pi) / (2 * pi)))


ARMS = {
    arm.name: arm
    for arm in (
        UrArm("ur3e", (-0.24355, -0.2132), (0.15185, 0.13105, 0.08535, 0.0921)),
        UrArm("ur5e", (-0.425, -0.3922), (0.1625, 0.1333, 0.0997, 0.0996)),
        UrArm("ur10e", (-0.6127, -0.57155), (0.1807, 0.17415, 0.11985, 0.11655)),
    )
}
"""The arms by name."""


def arm_named(name: str) -> UrArm:
    """The arm of that name, or an `InputError` that lists them."""
    if name not in ARMS:
        raise InputError(f"no arm is called '{name}': choose one of {', '.join(ARMS)}")
    return ARMS[name]
