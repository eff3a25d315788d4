"""Damped Gauss-Newton steps on contour points, coarse to fine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.se3 import Array
from hecbench_plugins.maskless.contour import ContourEquations, ContourMatcher
from hecbench_plugins.maskless.settings import CONTOUR


@dataclass(frozen=True)
class RefinementLevel:
    """A round of refinement: canvas pixels per pixel, pixels between samples, iterations, and with which background."""

    level: int
    spacing: float
    rounds: int
    background: bool


def schedule(width_px: int) -> tuple[tuple[RefinementLevel, ...], RefinementLevel]:
    """The steps from a start decimetres away, and the last one, for a canvas of this width."""
    coarsest = 1
    while width_px / coarsest > CONTOUR.coarsest_px:
        coarsest *= 2
    steps = [RefinementLevel(coarsest, 4, 8, True), RefinementLevel(coarsest, 2, 6, True)]
    level = coarsest // 2
    while level > 1:
        steps += [RefinementLevel(level, 2, 4, True), RefinementLevel(level, 1, 5, True)]
        level //= 2
    if coarsest <= 2:
        steps.append(RefinementLevel(1, 2, 4, True))
    return tuple(steps), RefinementLevel(1, 1, 15, False)


@dataclass(frozen=True, eq=False)
class Refined:
    """Where a refinement ended, with the comparison there."""

    camera_T_parent: Array
    last: ContourEquations
    iterations: int
    converged: bool


def refine(
    lines: ContourMatcher, camera_T_parent: Array, step: RefinementLevel, sigmas: float = CONTOUR.settled
) -> Refined:
    """Damped Gauss-Newton steps of limited length at one size, until a move is `sigmas` standard deviations long."""
    lines.learn(camera_T_parent, step.spacing)
    found = lines(camera_T_parent, step.spacing)
    return refine_further(lines, Refined(camera_T_parent, found, 0, False), step, 0.0, sigmas)


def refine_further(
    lines: ContourMatcher,
    start: Refined,
    step: RefinementLevel,
    radius_m: float,
    sigmas: float = CONTOUR.settled,
) -> Refined:
    """The same from a comparison that was made within `radius_m` already, by the colours found there."""
    pose, found, converged, iteration = start.camera_T_parent, start.last, False, 0
    relaxation, before = 1.0, None
    for iteration in range(1, step.rounds + 1):  # noqa: B007 the number of the last is reported
        if found.points < CONTOUR.fewest_points:
            break
        move = np.linalg.solve(found.A + np.diag(CONTOUR.damping * np.diag(found.A) + 1e-9), found.b)
        relaxation, before = relaxed(relaxation, before, move, found.A), move
        pose = se3.exp(limited(relaxation * move)) @ pose
        found = lines(pose, step.spacing, radius_m=radius_m)
        converged = settled(found, move, sigmas)
        if converged:
            break
    return Refined(pose, found, start.iterations + iteration, converged)


def relaxed(relaxation: float, before: NDArray[Any] | None, move: NDArray[Any], information: Array) -> float:
    """By how much to lengthen a move (M,) that goes on in the direction of the one before.

    Posteriors pull the contour only part of the way, so that moves shrink like a geometric series; its sum is known
    from two of them (Irons and Tuck 1969, "A version of the Aitken accelerator for computer iteration", eq. 8).

    Args:
        relaxation: of the move before.
        before: None at first.
        move: not lengthened.
        information: (M, M), which measures both.
    """
    if before is None:
        return 1.0
    along, squares = float(before @ information @ move), float(before @ information @ before)
    if along < CONTOUR.same_direction * np.sqrt(squares * float(move @ information @ move)):
        return 1.0
    return min(max(relaxation / max(1 - along / squares, 1e-3), 1.0), CONTOUR.most_relaxation)


def settled(found: ContourEquations, move: NDArray[Any], sigmas: float = CONTOUR.settled) -> bool:
    """Whether a move (6 + ...) is shorter than so many standard deviations of what the images can tell."""
    return float(move @ found.A @ move) < CONTOUR.correlated_points * sigmas**2


def limited(move: NDArray[Any]) -> Array:
    """The move (6 + ...) shortened until neither turn nor shift of the camera is too long to be believed."""
    turn, shift = float(np.linalg.norm(move[:3])), float(np.linalg.norm(move[3:6]))
    return np.asarray(
        move * min(1.0, CONTOUR.most_move_rad / max(turn, 1e-12), CONTOUR.most_move_m / max(shift, 1e-12))
    )
