"""Target poses from the pictures alone, all at once, by Levenberg-Marquardt on the reprojection error."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.bundle.model import Sensor
from hecbench.se3 import Array

_ITERATIONS = 30
_CONVERGED = 1e-10
"""Relative fall of the cost."""
_EXACT = 1e-16
"""px^2."""
_SHARED_CONVERGED = 1e-6


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

    def where(self, better: NDArray[np.bool_], there: Normals) -> Normals:
        """These, with the pictures that are `better` (M,) from elsewhere."""
        pairs = [(getattr(self, item.name), getattr(there, item.name)) for item in fields(self)]
        return Normals(*(np.where(better.reshape(-1, *[1] * (a.ndim - 1)), b, a) for a, b in pairs))

    def only(self, chosen: NDArray[np.bool_]) -> Normals:
        """Those of the `chosen` (M,) pictures."""
        return Normals(*(getattr(self, item.name)[chosen] for item in fields(self)))


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
    costs, damping, moving = at.costs.copy(), np.full(len(poses), 1e-4), np.arange(len(poses))
    for _ in range(_ITERATIONS):
        transposed = np.swapaxes(at.by_pose, 1, 2)
        information = transposed @ at.by_pose
        gradient = transposed @ at.residuals_px.reshape(len(moving), -1, 1)
        step = np.linalg.solve(_damped(information, damping[:, None]), gradient)[..., 0]
        moved = se3.exp(-step) @ poses[moving]
        there = linearised(moved, points_m, corners_px[moving], sensor, none)
        better = there.costs <= at.costs
        both = np.isfinite(at.costs) & np.isfinite(there.costs)
        change = np.subtract(at.costs, there.costs, where=both, out=np.full(len(moving), np.inf))
        poses[moving[better]] = moved[better]
        damping = np.where(better, np.maximum(damping / 10, 1e-12), damping * 10)
        at = at.where(better, there)
        costs[moving] = at.costs
        left = np.abs(change) > _CONVERGED * at.costs + _EXACT
        at, damping, moving = at.only(left), damping[left], moving[left]
        if not len(moving):
            break
    seen = np.isfinite(corners_px).all(-1).sum(1)
    return poses, np.sqrt(costs / np.maximum(seen, 1))


@dataclass(frozen=True, eq=False)
class SharedFit:
    """Target poses (M, 4, 4) of all pictures with what they share: the camera's parameters and the board's pitch.

    Attributes:
        pitch: the distance of rows over that of columns, times the declared one.
        squares_px2: of all residuals.
        free: how many shared numbers were fitted.
    """

    camera_T_target: Array
    parameters: Array
    pitch: float
    squares_px2: float
    free: int


def fit_shared(
    camera_T_target: Array,
    points_m: Array,
    corners_px: Array,
    sensor: Sensor,
    parameters: Array,
    basis: Array,
) -> SharedFit:
    """Poses and shared unknowns at the least reprojection error; poses are eliminated by the Schur complement.

    Args:
        camera_T_target: (M, 4, 4) m, the start.
        points_m: (P, 3) in the target's frame.
        corners_px: (M, P, 2), NaN where not seen.
        sensor: with K parameters.
        parameters: (K,), the start.
        basis: (K + 1, F) directions in which parameters and the logarithm of the pitch may change.
    """
    poses, values, log_pitch, damping = camera_T_target, parameters, 0.0, 1e-4
    at, shared = _with_pitch(poses, points_m, log_pitch, corners_px, sensor, values)
    for _ in range(_ITERATIONS):
        J, r = shared @ basis, at.residuals_px.reshape(len(poses), -1, 1)
        own = np.swapaxes(at.by_pose, 1, 2)
        information = _damped(own @ at.by_pose, damping)
        eliminated = np.linalg.solve(information, np.concatenate([own @ J, own @ r], -1))
        reduced = (np.swapaxes(J, 1, 2) @ np.concatenate([J, r], -1)).sum(0)
        reduced -= (np.swapaxes(J, 1, 2) @ at.by_pose @ eliminated).sum(0)
        step = -np.linalg.lstsq(_damped(reduced[:, :-1], damping), reduced[:, -1], rcond=1e-12)[0]
        change = basis @ step
        turned = se3.exp(-(eliminated[..., -1] + eliminated[..., :-1] @ step)) @ poses
        moved = turned, values + change[:-1], log_pitch + float(change[-1])
        there, shared_there = _with_pitch(moved[0], points_m, moved[2], corners_px, sensor, moved[1])
        before, after = at.costs.sum(), there.costs.sum()
        if not after <= before:
            damping *= 10
            if damping > 1e8:
                break
            continue
        (poses, values, log_pitch), at, shared, damping = moved, there, shared_there, max(damping / 10, 1e-10)
        if before - after <= _SHARED_CONVERGED * after:
            break
    return SharedFit(poses, values, float(np.exp(log_pitch)), float(at.costs.sum()), basis.shape[1])


def _with_pitch(
    poses: Array, points_m: Array, log_pitch: float, corners_px: Array, sensor: Sensor, parameters: Array
) -> tuple[Normals, Array]:
    """`linearised` for a board of this pitch, and the derivatives (M, 2 P, K + 1) by parameters and log pitch."""
    points = points_m * [1.0, np.exp(log_pitch), 1.0]
    at = linearised(poses, points, corners_px, sensor, parameters)
    # A shift of a point along the board's y axis moves it in the camera as a translation of its own would.
    by_point = at.by_pose[..., 3:].reshape(*at.residuals_px.shape, 3)
    along = (by_point @ poses[:, None, :3, 1:2])[..., 0] * points[:, 1][:, None]
    return at, np.concatenate([at.by_shared, along.reshape(len(poses), -1, 1)], -1)


def _damped(information: Array, damping: Array | float) -> Array:
    diagonal = np.maximum(np.diagonal(information, axis1=-2, axis2=-1), 1e-12)
    return information + (damping * diagonal)[..., None] * np.eye(diagonal.shape[-1])
