"""Time-stamped pose streams with clocks of their own; the order of a quaternion's numbers is irrelevant."""

from __future__ import annotations

import numpy as np

from hecbench.se3 import Array

_GRID_S = 0.005
_LEAST_CORRELATION = 0.5
_SMALL_RAD = 1e-6
_FRAMES = 10
_SEARCH_S = 0.05
_UNITS_S = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_EPOCH_S = (1e9, 4e9)
"""Seconds since 1970 of the years 2001 to 2096."""
_SLOWEST_S = 5.0
"""Between two rows of a stream; rows further apart are taken for smaller units."""
_SAME_SPAN = 10.0
_CLEARLY_BETTER = 2.0


def clock_units(robot_stamps: Array, camera_stamps: Array) -> tuple[str, str]:
    """The units of two streams' stamps: of seconds since 1970 by magnitude, of others by their rate.

    Both streams span about the same time; of the units that make them so, the largest with rows close in time.
    """

    def possible(stamps: Array) -> list[str]:
        since_1970 = [u for u, s in _UNITS_S.items() if _EPOCH_S[0] < np.median(stamps) * s < _EPOCH_S[1]]
        step = float(np.median(np.diff(stamps))) if len(stamps) > 1 else 0.0
        return since_1970 or [u for u, s in _UNITS_S.items() if step * s < _SLOWEST_S] or ["ns"]

    def disagreement(units: tuple[str, str]) -> float:
        spans = _span(robot_stamps) * _UNITS_S[units[0]], _span(camera_stamps) * _UNITS_S[units[1]]
        return float(np.abs(np.log(max(spans[0], 1e-12) / max(spans[1], 1e-12))))

    pairs = [(r, c) for r in possible(robot_stamps) for c in possible(camera_stamps)]
    return next(
        (pair for pair in pairs if disagreement(pair) < np.log(_SAME_SPAN)), min(pairs, key=disagreement)
    )


def _span(stamps: Array) -> float:
    """From the first stamp to the last, whatever a few stray ones say."""
    return float(np.median(np.diff(stamps))) * (len(stamps) - 1) if len(stamps) > 1 else 0.0


def in_seconds(stamps: Array, unit: str) -> Array:
    """Stamps (N,) of a unit in s."""
    return stamps * _UNITS_S[unit]


def time_offset_s(
    robot_stamps: Array, robot: Array, camera_stamps: Array, camera: Array
) -> tuple[float | None, float]:
    """Seconds to add to the camera's stamps to get the robot's clock, and the correlation there.

    A rigid motion turns by the same angle seen from the robot and from the camera. So the two turning speeds
    over time are one curve, shifted; where they correlate best, the angles turned over several camera frames
    refine the shift. None when they correlate below 0.5: the offset is unknown.

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
        return None, float(correlation[peak])
    shift = peak - (len(second) - 1) + _vertex(correlation[max(peak - 1, 0) : peak + 2])
    coarse = robot_stamps[0] - camera_stamps[0] + shift * _GRID_S
    inside = (camera_stamps + coarse > robot_stamps[0] + _SEARCH_S) & (
        camera_stamps + coarse < robot_stamps[-1] - _SEARCH_S
    )
    stamps, turned = camera_stamps[inside], _turned(camera[inside], _FRAMES)
    if not len(turned):
        return float(coarse), float(correlation[peak])

    def mismatch(offset: float) -> float:
        return _mismatch(robot_stamps, robot, stamps + offset, turned)

    bounds = coarse - _SEARCH_S, coarse + _SEARCH_S
    return float(minimize_scalar(mismatch, bounds=bounds, method="bounded").x), float(correlation[peak])


def lag_s(stamps: Array, robot: Array, camera: Array) -> float | None:
    """The offset of a camera whose pictures were stamped with the robot's time, where they were taken earlier.

    None unless the turning speeds show it: a shift of more than a quarter of a frame that leaves less than half of the
    angles' mismatch.
    """
    offset, _ = time_offset_s(stamps, robot, stamps, camera)
    if offset is None or abs(offset) < np.median(np.diff(stamps)) / 4:
        return None
    inside = (stamps + offset >= stamps[0]) & (stamps + offset <= stamps[-1])
    kept, turned = stamps[inside], _turned(camera[inside], _FRAMES)
    if len(turned) < _FRAMES:
        return None
    as_stamped, shifted = (_mismatch(stamps, robot, kept + shift, turned) for shift in (0.0, offset))
    return offset if as_stamped > _CLEARLY_BETTER**2 * shifted else None


def _mismatch(stamps: Array, poses: Array, at: Array, turned: Array) -> float:
    """Mean squared difference rad^2 between angles (M,) and those of the poses at times (M + 10,) s."""
    return float(np.mean((_turned(interpolate(stamps, poses, at), _FRAMES) - turned) ** 2))


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
