"""Poses as the maker writes them, and circles."""

from __future__ import annotations

import numpy as np

from hecbench import se3
from hecbench.se3 import Array


def pose_of(vector: Array) -> Array:
    """Transform (4, 4) of the maker's pose vector (6,): metres and rotation vector."""
    return se3.from_rotvec(vector[3:6], vector[:3])


def vector_of(a_T_b: Array) -> Array:
    """The maker's pose vector (6,) of a transform (4, 4)."""
    return np.concatenate([a_T_b[:3, 3], se3.so3_log(a_T_b[:3, :3])])


def circle_centre(a: Array, b: Array, c: Array) -> Array:
    """Centre of the circle through three points (3,) that are not on a line."""
    ab, ac = b - a, c - a
    normal = np.cross(ab, ac)
    offset = (ac @ ac) * np.cross(normal, ab) + (ab @ ab) * np.cross(ac, normal)
    return np.asarray(a + offset / (2 * normal @ normal))


def angle_about(normal: Array, a: Array, b: Array) -> float:
    """Angle in (0, 2 pi] from a to b (3,) about a unit normal."""
    angle = float(np.arctan2(normal @ np.cross(a, b), a @ b)) % (2 * np.pi)
    return angle or 2 * np.pi
