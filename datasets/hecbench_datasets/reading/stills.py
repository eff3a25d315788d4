"""Moments in which a robot stands still, and how far a camera's clock is off, by how much its pictures change."""

from __future__ import annotations

import numpy as np

from hecbench.se3 import Array

_WINDOW_S = 0.2
"""Over which a speed is taken: longer than the jitter of stamps, shorter than a stop."""
_STILL_PER_S = 0.02
"""Rad/s of joints or turns; a metre counts as two radians."""
_LEAST_S = 0.3
_SETTLING_S = 0.1
"""After the robot stopped, for the arm to swing out and the clocks to differ a little."""
_ELSEWHERE = 0.02
"""Rad (or half metres) between two moments that are not the same."""
_GRID_S = 0.02
_LONGEST_OFFSET_S = 5.0
_LEAST_CORRELATION = 0.5
_CLEARLY = 0.05
"""By which a correlation must exceed those further away."""


def still_moments(stamps: Array, values: Array) -> list[tuple[float, float]]:
    """Start and end, s, of each moment in which the values stand still, in order, each elsewhere than the last.

    Args:
        stamps: (N,) s in order.
        values: (N, D) rad, or half metres.
    """
    speed = _speed(stamps, values, stamps)
    still = np.concatenate([[False], speed < _STILL_PER_S, [False]])
    edges = np.flatnonzero(np.diff(still.astype(int)))
    found: list[tuple[float, float]] = []
    last: Array | None = None
    for first, after in zip(edges[::2], edges[1::2], strict=True):
        start, end = stamps[first] + _SETTLING_S, stamps[after - 1]
        place = np.median(values[first:after], axis=0)
        elsewhere = last is None or np.abs(place - last).max() > _ELSEWHERE
        if end - start >= _LEAST_S and elsewhere:
            found.append((float(start), float(end)))
            last = place
    return found


def _speed(stamps: Array, values: Array, at: Array) -> Array:
    """Largest speed (M,) of the values over a window about times (M,) s."""
    before, after = (
        np.stack([np.interp(at + shift, stamps, column) for column in values.T], 1)
        for shift in (-_WINDOW_S / 2, _WINDOW_S / 2)
    )
    return np.asarray(np.abs(after - before).max(1) / _WINDOW_S)


def offset_by_change_s(
    stamps: Array, values: Array, picture_stamps: Array, change: Array
) -> tuple[float | None, float]:
    """Seconds to add to the pictures' stamps to get the robot's clock, and the correlation there.

    Pictures change while the robot moves. None when speed and change correlate below 0.5, or nearly as well elsewhere.

    Args:
        stamps: (N,) s of the robot.
        values: (N, D) of the robot.
        picture_stamps: (M,) s.
        change: (M,) how much each picture differs from the one before; the first is not used.
    """
    middle = (picture_stamps[1:] + picture_stamps[:-1]) / 2
    if len(middle) < 10:
        return None, 0.0
    grid = np.arange(middle[0], middle[-1], _GRID_S)
    seen = _standardised(np.sqrt(np.interp(grid, middle, change[1:])))
    reach = round(_LONGEST_OFFSET_S / _GRID_S)
    shifts = np.arange(-reach, reach + 1) * _GRID_S
    scores = np.array([_correlation(seen, grid + shift, stamps, values) for shift in shifts])
    best = int(np.nanargmax(scores)) if np.isfinite(scores).any() else -1
    if best < 0 or scores[best] < _LEAST_CORRELATION:
        return None, float(scores[best]) if best >= 0 else 0.0
    far = np.abs(shifts - shifts[best]) > 1.0
    if far.any() and np.nanmax(scores[far]) > scores[best] - _CLEARLY:
        return None, float(scores[best])
    return float(shifts[best]), float(scores[best])


def _correlation(seen: Array, at: Array, stamps: Array, values: Array) -> float:
    """Of what is seen with the robot's speed at these times, where it is known; NaN when less than half is."""
    inside = (at > stamps[0]) & (at < stamps[-1])
    if inside.sum() < len(at) / 2:
        return float("nan")
    speed = np.sqrt(_speed(stamps, values, at[inside]))
    return float(np.mean(_standardised(speed) * _standardised(seen[inside])))


def _standardised(values: Array) -> Array:
    deviation = values.std()
    return np.asarray((values - values.mean()) / deviation if deviation > 0 else np.zeros(len(values)))
