"""Cameras all over a sphere around a robot, and the best of scored poses that are not alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hecbench import se3
from hecbench.se3 import Array

_GOLDEN_RAD = np.pi * (3 - np.sqrt(5))
"""Between neighbours of a Fibonacci lattice (Gonzalez 2010)."""
_STRAIGHT_DOWN = 0.999
"""Cosine to the vertical from which on "upright" no longer says how a camera is turned."""
_APART = 0.05
"""Rotation, rad, and shift as a share of the distance, below which two poses are alike."""


@dataclass(frozen=True)
class ViewSphere:
    """From where a camera may look at the robot.

    Attributes:
        spacing_deg: between neighbouring directions.
        lowest_deg: least elevation above the base's horizontal plane.
        rolls_deg: turns about the optical axis, from where the base's z points up in the image.
    """

    spacing_deg: float = 12.0
    lowest_deg: float = -6.0
    rolls_deg: tuple[float, ...] = (-30.0, -15.0, 0.0, 15.0, 30.0)

    def directions(self) -> Array:
        """Unit vectors (M, 3) from the robot to the camera, in the base frame: a Fibonacci lattice."""
        height = 1 - np.sin(np.deg2rad(self.lowest_deg))
        count = int(np.ceil(2 * np.pi * height / np.deg2rad(self.spacing_deg) ** 2))
        z = 1 - height * (np.arange(count) + 0.5) / count
        azimuth = _GOLDEN_RAD * np.arange(count)
        across = np.sqrt(1 - z**2)
        return np.stack([across * np.cos(azimuth), across * np.sin(azimuth), z], -1)

    def rotations(self) -> Array:
        """camera_R_base (N, 3, 3) of cameras that look against each direction with each roll."""
        level = np.array([_level(-outward) for outward in self.directions()])
        rolls = se3.so3_exp(np.deg2rad([[0.0, 0.0, roll] for roll in self.rolls_deg]))
        return np.asarray((rolls[None] @ level[:, None]).reshape(-1, 3, 3))


def _level(forward: Array) -> Array:
    up = [0, 0, 1] if abs(forward[2]) < _STRAIGHT_DOWN else [1, 0, 0]
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


def look_at(rotations: Array, point_m: Array, ray: Array, distance_m: float) -> Array:
    """camera_T_base (N, 4, 4) of cameras that see a point of the base frame at a distance, on a ray (x, y, 1)."""
    return se3.make(rotations, distance_m * ray / np.linalg.norm(ray) - rotations @ point_m)


def best_apart(
    poses: Sequence[Array], scores: Sequence[float], count: int, apart: float = _APART
) -> list[int]:
    """Indices of the best poses (camera_T_base), best first, no two alike.

    Alike are poses whose rotations differ by less than `apart` rad and whose base origins by less than that share
    of their distance.
    """
    chosen: list[int] = []
    for i in np.argsort(-np.asarray(scores), kind="stable"):
        if len(chosen) == count:
            break
        if not any(alike(poses[i], poses[j], apart) for j in chosen):
            chosen.append(int(i))
    return chosen


def alike(a: Array, b: Array, apart: float = _APART) -> bool:
    """Whether two poses camera_T_base differ by less than `apart`, see `best_apart`."""
    shift = np.linalg.norm(a[:3, 3] - b[:3, 3]) / np.linalg.norm(b[:3, 3])
    return bool(shift < apart and se3.rotation_error_rad(a, b) < apart)
