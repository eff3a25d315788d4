"""Where the gripper works, as points at which calibrations are compared: one definition for every evaluator."""

from __future__ import annotations

import numpy as np

from hecbench import se3
from hecbench.se3 import Array

CUBE_M = 0.4


def cube_corners(base_T_flange: Array) -> Array:
    """Corners (8, 3) m of a 0.4 m cube, axes of the base, centred on the mean of flange poses (N, 4, 4)."""
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
    return np.asarray(base_T_flange[:, :3, 3].mean(0) + CUBE_M / 2 * signs)


def points_in_parent(base_T_flange: Array, camera_moves: bool) -> Array:
    """The cube's corners (8, 3) m in the base, or (8 N, 3) in the flange where the camera moves with it.

    Args:
        base_T_flange: (N, 4, 4) m; rows that hold NaN are left out.
        camera_moves: whether the parent is the flange (eye in hand).
    """
    base_T_flange = base_T_flange[np.isfinite(base_T_flange).all((1, 2))]
    corners = cube_corners(base_T_flange)
    if not camera_moves:
        return corners
    return np.asarray(se3.transform_points(se3.inverse(base_T_flange), corners).reshape(-1, 3))


def apart_m(parent_T_camera: Array, other: Array, points_m: Array) -> Array:
    """Rms displacement (...,) m of points (P, 3) in the parent between two answers (..., 4, 4).

    ``|X inverse(X') w - w|``, which the robot's own pose does not change: the target registration error when `other`
    is the truth.
    """
    moved = se3.transform_points(parent_T_camera @ se3.inverse(other), points_m) - points_m
    return np.asarray(np.sqrt((moved**2).sum(-1).mean(-1)))


def squared_displacement(points_m: Array) -> Array:
    """(6, 6) form Q of a left twist ``[phi rad, rho m]``: ``twist @ Q @ twist`` is the mean square, m^2."""
    derivative = np.concatenate([-se3.hat(points_m), np.tile(np.eye(3), (len(points_m), 1, 1))], 2)
    return np.asarray((np.swapaxes(derivative, 1, 2) @ derivative).mean(0))
