"""Robot poses that belong to other images: shifted by a few samples, all or from one on, or sorted as text."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from hecbench.diagnose.case import Examination
from hecbench.diagnose.fit import EXPLAINS, Fit
from hecbench.se3 import Array

Indices = NDArray[np.int64]

FARTHEST = 3
"""Samples by which streams are shifted in practice."""
_WINDOWS = (7, 6, 5)
"""Neighbouring samples that are calibrated alone; fewer where a break leaves no run of more."""
_SWITCH = 1.5
"""Cost of a change of shift, in limited residuals: it must mend two samples or more."""
_AGREEING = 0.8
"""Share of the samples that must fit once they are shifted."""


def text_orders(count: int) -> Iterator[tuple[str, Indices]]:
    """How so many samples are permuted when one stream is sorted as text ("1", "10", "2") and the other by number."""
    for first in (0, 1):
        by_text = np.array(sorted(range(count), key=lambda i: str(i + first)))
        if (by_text != np.arange(count)).any():
            yield (
                "the robot poses are sorted as text (1, 10, 11, 2), the images by number",
                np.argsort(by_text),
            )
            yield "the images are sorted as text (1, 10, 11, 2), the robot poses by number", by_text


def shifts(case: Examination) -> Indices | None:
    """By how many samples each image's robot pose is displaced (N,); None when none or no few runs explain the data.

    A calibration of some neighbouring samples says which robot pose each image fits; the runs of equal shifts with the
    least residual are found by dynamic programming (Viterbi 1967).
    """
    for fit in _from_windows(case):
        path = _path(case, fit)
        if path is not None:
            return path
    return None


def _path(case: Examination, fit: Fit) -> Indices | None:
    moves = np.arange(-FARTHEST, FARTHEST + 1)
    limit = EXPLAINS * _motion_px(fit)
    costs = np.stack([_limited(fit, case.base_T_flange, int(move), limit) for move in moves], 1)
    path = moves[_cheapest(costs)]
    partners = np.arange(len(path)) + path
    paired = (partners >= 0) & (partners < len(path))
    fits = costs[np.arange(len(path)), path + FARTHEST] < 1.0
    if not path[paired].any() or fits[paired].mean() < _AGREEING:
        return None
    return np.asarray(path)


def _motion_px(fit: Fit) -> float:
    centres = fit.problem.observed.mean(1)
    return float(np.median(np.linalg.norm(centres - np.median(centres, axis=0), axis=1)))


def _from_windows(case: Examination) -> list[Fit]:
    """Calibrations of neighbouring samples that agree, applied to all; the best first."""
    if case.fit is None:
        return []
    count, found = len(case.usable), []
    for size in sorted({max(window, count // 3) for window in _WINDOWS if window <= count}):
        for first in sorted({0, (count - size) // 2, count - size}):
            part = slice(first, first + size)
            fit = case.fit_of(case.base_T_flange[part], case.camera_T_target[part])
            if fit is not None and fit.relative < EXPLAINS:
                found.append(fit)
    found.sort(key=lambda fit: fit.relative)
    return [Fit(case.fit.problem, fit.state, fit.focal_px) for fit in found]


def _limited(fit: Fit, base_T_flange: Array, move: int, limit: float) -> Array:
    """Residuals (N,) over the limit, at most 1, when image i has the robot pose i + move; 1 where there is none."""
    partners = np.arange(len(base_T_flange)) + move
    inside = (partners >= 0) & (partners < len(partners))
    moved = fit.with_robot_poses(base_T_flange[np.where(inside, partners, 0)])
    return np.where(inside, np.minimum(np.nan_to_num(moved.residuals_px / limit, nan=1.0), 1.0), 1.0)


def _cheapest(costs: Array) -> Indices:
    """The path (N,) through states (N, S) with the least cost, each change of state costing the same."""
    total, came = costs[0], np.zeros(costs.shape, int)
    for i in range(1, len(costs)):
        ways = total[:, None] + _SWITCH * (1 - np.eye(len(total)))
        came[i] = ways.argmin(0)
        total = ways.min(0) + costs[i]
    path = np.zeros(len(costs), int)
    path[-1] = int(total.argmin())
    for i in range(len(costs) - 1, 0, -1):
        path[i - 1] = came[i, path[i]]
    return path
