"""Target poses from the pictures alone, all at once, by Levenberg-Marquardt on the reprojection error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.bundle.model import Sensor

Array = NDArray[np.float64]

_ITERATIONS = 30
_CONVERGED = 1e-10
"""Relative fall of the cost."""


@dataclass(frozen=True, eq=False)
class Normals:
    """Residuals of M pictures and their normal equations.

    Attributes:
        residuals_px: predicted minus seen (M, P, 2), 0 where a point was not seen.
        costs: (M,) sums of squares, px^2; infinite with a point behind the camera.
        by_pose: (M, 2 P, 6) by left increments of camera_T_target, rotation first.
        by_shared: (M, 2 P, K) by the sensor's parameters.
        points_c: (M, P, 3) m.
    """

    residuals_px: Array
    costs: Array
    by_pose: Array
    by_shared: Array
    points_c: Array


def linearised(
    camera_T_target: Array, points_m: Array, corners_px: Array, sensor: Sensor, parameters: Array
) -> Normals:
    """Pictures (M, P, 2), NaN where a point was not seen, of points (P, 3) m at poses (M, 4, 4)."""
    points_c = se3.transform_points(camera_T_target, points_m)
    flat = points_c.reshape(-1, 3)
    behind = flat[:, 2] <= 0
    values, by_point, by_parameter = sensor(np.where(behind[:, None], [0.0, 0.0, 1.0], flat), parameters)
    seen = np.asarray(np.isfinite(corners_px).all(-1))
    shape, rows = (*seen.shape, 2), (len(seen), 2 * seen.shape[1])
    residuals = np.where(seen[..., None], values.reshape(shape) - corners_px, 0.0)
    costs = (residuals**2).sum((1, 2))
    costs[(behind.reshape(seen.shape) & seen).any(1)] = np.inf
    by_point = by_point.reshape(*shape, 3) * seen[..., None, None]
    by_pose = np.concatenate([np.cross(points_c[:, :, None], by_point), by_point], -1)
    by_shared = by_parameter.reshape(*shape, len(parameters)) * seen[..., None, None]
    return Normals(
        residuals, costs, by_pose.reshape(*rows, 6), by_shared.reshape(*rows, len(parameters)), points_c
    )


def refined(
    camera_T_target: Array, points_m: Array, corners_px: Array, sensor: Sensor
) -> tuple[Array, Array]:
    """Each pose (M, 4, 4) at its minimum of the reprojection error, and that error's rms (M,) px over the points seen.

    The arguments are those of `linearised`, for a sensor without parameters.
    """
    poses, none = camera_T_target.copy(), np.zeros(0)
    at = linearised(poses, points_m, corners_px, sensor, none)
    damping = np.full(len(poses), 1e-4)
    for _ in range(_ITERATIONS):
        transposed = np.swapaxes(at.by_pose, 1, 2)
        information = transposed @ at.by_pose
        diagonal = np.maximum(np.diagonal(information, axis1=1, axis2=2), 1e-12)
        gradient = transposed @ at.residuals_px.reshape(len(poses), -1, 1)
        damped = information + (damping[:, None] * diagonal)[:, None] * np.eye(6)
        moved = se3.exp(-np.linalg.solve(damped, gradient)[..., 0]) @ poses
        there = linearised(moved, points_m, corners_px, sensor, none)
        better = there.costs <= at.costs
        gained = np.where(better & np.isfinite(at.costs), at.costs - there.costs, 0.0)
        poses[better] = moved[better]
        damping = np.where(better, np.maximum(damping / 10, 1e-12), damping * 10)
        settled = (gained <= _CONVERGED * there.costs + 1e-18) & (better | (damping > 1e6))
        at = linearised(poses, points_m, corners_px, sensor, none)
        if settled.all():
            break
    seen = np.isfinite(corners_px).all(-1).sum(1)
    return poses, np.sqrt(at.costs / np.maximum(seen, 1))
