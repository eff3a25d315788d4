"""Target size, focal length and principal point against each other: which of them explains how the target moves.

A focal length that is too long looks much like a target that is too large: both put the target too far away. The
corners themselves, with the robot's motion, tell them apart where the target moved in depth and across the view.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hecbench.bundle.adjustment import DescentSettings, Solution, adjust
from hecbench.bundle.model import Noise, Problem, start
from hecbench.diagnose.calibrate import spread
from hecbench.diagnose.case import Examination
from hecbench.diagnose.fit import TYPICAL_NOISE
from hecbench.errors import SolverFailure
from hecbench.lens import Sensor, parameters_of
from hecbench.se3 import Array

GIVEN, SIZE, FOCAL, CENTRE, BOTH = (
    "given",
    "size",
    "focal length",
    "principal point",
    "focal length and principal point",
)
CLEARLY = 15.0
ALIKE = 10.0
"""Differences of scores: strong evidence, and too little to decide (Kass and Raftery 1995, section 3.2)."""
_FIXED = 1e-9
_FOCAL_PRIOR = 0.3
"""Of the focal length, one sigma: any other lens of the kind."""
_CENTRE_PRIOR = 0.2
"""Of the image's width: a crop."""
_LEAST_NOISE_PX = 0.1
_MOST_POINTS = 60


@dataclass(frozen=True, eq=False)
class Explanation:
    """One thing set free, and what that leaves.

    Attributes:
        freed: which.
        score: robust chi-square plus the logarithm of the observations for each unknown (Schwarz 1978), both divided
            by what the best explanation leaves beyond noise.
        scale: the target's true size over the declared one.
        parameters: [fx, fy, cx, cy, distortion...].
    """

    freed: str
    score: float
    scale: float
    parameters: Array


def explanations(case: Examination) -> list[Explanation]:
    """What the agreeing samples say with each of them free, best first; empty without corners or a calibration."""
    recording = case.recording
    camera, target, corners = recording.camera, recording.target, recording.corners_px
    if case.agreed is None or case.solution is None or corners is None or target is None or camera is None:
        return []
    agreeing = np.flatnonzero(case.agreed[1])
    agreeing = agreeing[spread(len(agreeing))]
    points = np.unique(np.linspace(0, len(target.points_m) - 1, _MOST_POINTS).astype(int))
    known = parameters_of(camera)
    problem = Problem(
        recording.mounting,
        case.base_T_flange[agreeing],
        case.size_factor * target.points_m[points],
        corners[case.usable[agreeing]][:, points],
        Sensor(camera.distortion_model),
        known,
        np.full(len(known), _FIXED),
    )
    noise_px = max(_LEAST_NOISE_PX, (case.noise_px or TYPICAL_NOISE.observed * np.sqrt(2)) / np.sqrt(2))
    noise = replace(TYPICAL_NOISE, observed=noise_px)
    focal, centre = _FOCAL_PRIOR * known[:2], [_CENTRE_PRIOR * camera.width] * 2
    fixed = [_FIXED] * 2
    priors = {
        GIVEN: [*fixed, *fixed],
        SIZE: [*fixed, *fixed],
        FOCAL: [*focal, *fixed],
        CENTRE: [*fixed, *centre],
        BOTH: [*focal, *centre],
    }
    found = [_explained(case, problem, freed, sigmas, noise) for freed, sigmas in priors.items()]
    ranked = sorted((one for one in found if one is not None), key=lambda one: one.score)
    if not ranked:
        return []
    excess = max(1.0, ranked[0].score / max(2 * problem.seen.sum() - 12, 1))
    return [replace(one, score=one.score / excess) for one in ranked]


def _explained(
    case: Examination, problem: Problem, freed: str, sigmas: list[float], noise: Noise
) -> Explanation | None:
    all_sigmas = problem.parameter_sigmas.copy()
    all_sigmas[:4] = sigmas
    problem = replace(problem, parameter_sigmas=all_sigmas, free_scale=freed == SIZE)
    solution = _adjusted(case, problem, noise)
    if solution is None:
        return None
    unknowns = {GIVEN: 0, SIZE: 1, FOCAL: 2, CENTRE: 2, BOTH: 4}[freed]
    score = solution.at.cost + unknowns * float(np.log(2 * problem.seen.sum()))
    return Explanation(freed, score, solution.state.scale, solution.state.parameters)


def _adjusted(case: Examination, problem: Problem, noise: Noise) -> Solution | None:
    assert case.solution is not None
    first = start(problem, case.solution.state.parent_T_camera, case.solution.state.carrier_T_target)
    try:
        return adjust(problem, first, noise, DescentSettings(iterations=25))
    except (SolverFailure, np.linalg.LinAlgError):
        return None
