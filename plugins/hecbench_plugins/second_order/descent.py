"""Levenberg-Marquardt over views, and the history of what was drawn and accepted on the way.

camera_T_parent is turned by left perturbations [phi rad, rho m] in the camera frame.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from hecbench import se3
from hecbench.se3 import Array
from hecbench.system import threads
from hecbench_plugins.second_order.settings import DESCENT
from hecbench_plugins.views.pyramid import Level, View

NormalEquations = tuple[float, Array, Array]
"""Cost, J'WJ (6, 6) and -J'Wr (6,)."""


@dataclass
class Trace:
    """What happened on the way."""

    renders: int = 0
    iterations: int = 0
    poses: list[tuple[str, Array, float]] = field(default_factory=list)
    """Stage, camera_T_parent and cost of every accepted step."""


def draw_counted(view: View, level: int, camera_T_parent: Array, trace: Trace) -> Level:
    """Draw a view at a pose; returns its level."""
    trace.renders += 1
    return draw_uncounted(view, level, camera_T_parent)


def draw_uncounted(view: View, level: int, camera_T_parent: Array) -> Level:
    """The same for callers that count by themselves, as threads must."""
    at = view.levels[level]
    at.renderer.draw(camera_T_parent @ view.parent_T_link)
    return at


def draw_all(views: Sequence[View], work: Callable[[View], Level]) -> list[Level]:
    """The levels that `work` draws of the views, several of them in threads."""
    if len(views) == 1:
        return [work(views[0])]
    return threads.each(work, views)


@dataclass(frozen=True)
class Descent:
    """Where a descent ended: `ended` is "converged", "stalled" or "iterations"."""

    pose: Array
    cost: float
    normal: Array
    ended: str


def descend(
    step: Callable[[Array], NormalEquations],
    start: Array,
    iterations: int,
    trace: Trace,
    stage: str,
    small: float = DESCENT.small_step,
) -> Descent:
    """Levenberg-Marquardt with Marquardt's scaling; a step that does not lower the cost is taken back."""
    damping, pose = DESCENT.first_damping, start
    cost, A, b = step(pose)
    if not np.isfinite(cost):
        return Descent(pose, cost, A, "stalled")
    for _ in range(iterations):
        trace.iterations += 1
        move = np.linalg.solve(A + np.diag(damping * np.diag(A) + 1e-9 * np.trace(A) / 6 + 1e-12), b)
        size = float(np.linalg.norm(move))
        if size > DESCENT.longest_step:
            move *= DESCENT.longest_step / size
        proposed = se3.exp(move) @ pose
        new_cost, new_A, new_b = step(proposed)
        if new_cost < cost:
            pose, cost, A, b = proposed, new_cost, new_A, new_b
            damping = max(DESCENT.relaxed * damping, DESCENT.least_damping)
            trace.poses.append((stage, pose.copy(), cost))
            if np.abs(move).max() < small:
                return Descent(pose, cost, A, "converged")
        else:
            if np.abs(move).max() < 10 * small:
                return Descent(pose, cost, A, "converged")
            damping *= DESCENT.tightened
            if damping > DESCENT.most_damping:
                return Descent(pose, cost, A, "stalled")
    return Descent(pose, cost, A, "iterations")
