"""The advanced numbers of `render_gn`; `RenderGN` holds what a user may want to change.

Where no source is named, they come from a first prototype and from scenes of `synthetic` with seeds that no table
reports.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class DescentSettings:
    """Of Levenberg and Marquardt's descent.

    Attributes:
        first_damping, least_damping, most_damping: times the diagonal of the normal equations.
        relaxed, tightened: factors of the damping after a step that lowered the cost, and one that did not.
        longest_step: rad and m together.
        small_step: rad or m below which a descent has converged.
    """

    first_damping: float = 1e-3
    least_damping: float = 1e-7
    most_damping: float = 1e4
    relaxed: float = 0.2
    tightened: float = 10.0
    longest_step: float = 0.5
    small_step: float = 2e-6


@dataclass(frozen=True)
class StageSettings:
    """Of the stages.

    Attributes:
        fewest_crossings: of the drawn contour with the pixel grid, below which a pose says nothing.
        silhouette: level, px from which a distance counts less, and steps of each silhouette stage.
        colour: level and steps of each colour stage.
        most_rounds: of a descent at full size; nearly all converge in a dozen.
        blurs_px: sigmas of the pictures' blur that are tried.
        restart_turns_deg: of the start, tried until the overlap is good.
        fewest_pure: unmixed pixels of a part for its colour to be known.
        any_colour: spread of a part's colour before it is known, of [0, 1].
        darkest: colour, of [0, 1], below which it says nothing about a tone curve.
        fewest_parts: parts that a tone curve is fitted to.
        tone_misfit: largest rms misfit of a tone curve, of the logarithms, and least exponent off 1, to be believed.
        uneven_apart_px: noise of neighbours that demosaicing and compression have mixed is independent at this
            distance.
        uneven_sure: standard errors by which shading must exceed what noise alone would show.
        most_uneven: of [0, 1]: a good step of 8-bit pictures. Flat drawings with noise of 0.05 stay below it, a lit
            arm has 0.05.
        mask_reach_px: to both sides of the contour where a mask's change is looked for.
        violation_clip_px: violation of an interval from which on it counts less.
        coverage_weight: of the coverage beside the intervals.
    """

    fewest_crossings: int = 30
    silhouette: tuple[tuple[int, float, int], ...] = ((4, 15.0, 25), (2, 6.0, 12))
    colour: tuple[tuple[int, int], ...] = ((4, 8), (2, 8), (1, 40))
    most_rounds: int = 40
    blurs_px: tuple[float, ...] = (0.5, 0.75, 1.0, 1.25, 1.5, 2.0)
    restart_turns_deg: tuple[tuple[float, float, float], ...] = (
        (0, 0, 0),
        (0, 0, 25),
        (0, 0, -25),
        (0, 20, 0),
        (0, -20, 0),
        (20, 0, 0),
        (-20, 0, 0),
    )
    fewest_pure: int = 10
    any_colour: float = 10.0
    darkest: float = 0.02
    fewest_parts: int = 4
    tone_misfit: float = 0.05
    uneven_apart_px: int = 3
    uneven_sure: float = 3.0
    most_uneven: float = 0.005
    mask_reach_px: int = 2
    violation_clip_px: float = 0.1
    coverage_weight: float = 0.02


@dataclass(frozen=True)
class EvidenceSettings:
    """Of what is said about an answer.

    Attributes:
        blind: smallest over largest eigenvalue of the information below which there is no covariance.
        path_steps: of the way that are kept.
        near_px: the drawn contour is found where a mask's is this near.
        roughness: error over the sigma of the bare information: a sampled picture moves less smoothly than its
            derivative says. Measured on scenes of `synthetic` with noise 0.05 and no mask, 300 of LP with seed 31
            (1.18), 150 of HP with seed 32 (1.12) and 100 of MP with seed 11 (1.08); not derived.
        averaged_edges: `edge_excess` from which on the pictures count as those of a camera that averages over its
            pixels, with all the error that they share. Averages of 16 samples have 0.017 to 0.05 (640x480 to 64x48 px),
            pictures by this renderer 0 to 0.004.
        unseen: share of the prior's standard deviation that must be left for an unknown to count as not observable.
        joints_rad, scale, focal: priors of the further unknowns, standard deviations about 0; the last two relative.
    """

    blind: float = 1e-12
    path_steps: int = 40
    near_px: float = 2.0
    roughness: float = 1.16
    averaged_edges: float = 0.01
    unseen: float = 0.8
    joints_rad: float = float(np.deg2rad(0.5))
    scale: float = 0.02
    focal: float = 0.02


DESCENT, STAGES, EVIDENCE = DescentSettings(), StageSettings(), EvidenceSettings()
