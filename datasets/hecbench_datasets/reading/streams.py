"""Time-stamped pose streams with clocks of their own; the order of a quaternion's numbers is irrelevant."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_GRID_S = 0.005
_LEAST_CORRELATION = 0.5
_SMALL_RAD = 1e-6
_FRAMES = 10
_SEARCH_S = 0.05


def time_offset_s(
    robot_stamps: Array, robot: Array, camera_stamps: Array, camera: Array
) -> tuple[float, float]:
    """Seconds to add to the camera's stamps to get the robot's clock, and the correlation there.

    A rigid motion turns by the same angle seen from the robot and from the camera. So the two turning speeds
    over time are one curve, shifted; where they correlate best, the angles turned over several camera frames
    refine the shift. Zero when they correlate below 0.5.

    Args:
        robot_stamps: (N,) s in order.
        robot: poses (N, 7), quaternion last.
        camera_stamps: (M,) s in order.
        camera: poses (M, 7).
    """
    from scipy.optimize import minimize_scalar
    from scipy.signal import correlate

    robot_speed = _turning_speed(robot_stamps, robot)
    camera_speed = _turning_speed(camera_stamps, camera)
    first, second = robot_speed - robot_speed.mean(), camera_speed - camera_speed.mean()
    scale = np.linalg.norm(first) * np.linalg.norm(second)
    correlation = correlate(first, second, mode="full") / (scale or 1.0)
    peak = int(correlation.argmax())
    if correlation[peak] < _LEAST_CORRELATION:
        return 0.0, float(correlation[peak])
    shift = peak - (len(second) - 1) + _vertex(correlation[max(peak - 1, 0) : peak + 2])
    coarse = robot_stamps[0] - camera_stamps[0] + shift * _GRID_S
    inside = (camera_stamps + coarse > robot_stamps[0] + _SEARCH_S) & (
        camera_stamps + coarse < robot_stamps[-1] - _SEARCH_S
    )
    stamps, turned = camera_stamps[inside], _turned(camera[inside], _FRAMES)
    if not len(turned):
        return float(coarse), float(correlation[peak])

    def mismatch(offset: float) -> float:
        poses = interpolate(robot_stamps, robot, stamps + offset)
        return float(np.mean((_turned(poses, _FRAMES) - turned) ** 2))

    bounds = coarse - _SEARCH_S, coarse + _SEARCH_S
    return float(minimize_scalar(mismatch, bounds=bounds, method="bounded").x), float(correlation[peak])


def _turning_speed(stamps: Array, poses: Array) -> Array:
    """Speeds (G,) rad/s on a grid of 5 ms from the first stamp, constant between two stamps."""
    turned = np.concatenate([[0.0], np.cumsum(_turned(poses, 1))])
    grid = np.arange(stamps[0], stamps[-1], _GRID_S)
    return np.asarray(np.gradient(np.interp(grid, stamps, turned), _GRID_S))


def _turned(poses: Array, apart: int) -> Array:
    """Angles (N - apart,) rad between poses (N, 7) that many rows apart."""
    cosine = np.abs((poses[:-apart, 3:] * poses[apart:, 3:]).sum(1))
    return np.asarray(2 * np.arccos(np.clip(cosine, 0, 1)))


def _vertex(values: Array) -> float:
    """Where the parabola through three values peaks, relative to the middle one."""
    if len(values) < 3:
        return 0.0
    left, middle, right = values
    curvature = left - 2 * middle + right
    return float((left - right) / (2 * curvature)) if curvature < 0 else 0.0


def interpolate(stamps: Array, poses: Array, at: Array) -> Array:
    """Poses (M, 7) at times (M,) s inside the stamps (N,): straight lines and slerp (Shoemake 1985)."""
    right = np.clip(np.searchsorted(stamps, at), 1, len(stamps) - 1)
    left = right - 1
    gap = stamps[right] - stamps[left]
    weight = np.where(gap > 0, (at - stamps[left]) / np.where(gap > 0, gap, 1.0), 0.0)[:, None]
    position = (1 - weight) * poses[left, :3] + weight * poses[right, :3]
    from_turn, to_turn = poses[left, 3:], poses[right, 3:]
    cosine = (from_turn * to_turn).sum(1, keepdims=True)
    to_turn = np.where(cosine < 0, -to_turn, to_turn)
    angle = np.arccos(np.clip(np.abs(cosine), 0, 1))
    sine = np.maximum(np.sin(angle), _SMALL_RAD)
    near = angle < _SMALL_RAD
    first = np.where(near, 1 - weight, np.sin((1 - weight) * angle) / sine)
    second = np.where(near, weight, np.sin(weight * angle) / sine)
    turn = first * from_turn + second * to_turn
    return np.hstack([position, turn / np.linalg.norm(turn, axis=1, keepdims=True)])
