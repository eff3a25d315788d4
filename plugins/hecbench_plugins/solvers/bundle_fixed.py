"""Tabb and Ahmad Yousef 2017, "Solving the robot-world hand-eye(s) calibration problem with iterative
methods", rp1: reprojection error over X and Y with the robot poses taken as exact.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import Need, SolverSpec
from hecbench_plugins.markers.reprojection import adjust_with_exact_robot, corner_problem, to_estimate


def bundle_fixed(recording: Recording, *, rng: np.random.Generator) -> Estimate:
    """Levenberg-Marquardt from Single3D and Shah, with Huber's loss."""
    problem = corner_problem(recording)
    return to_estimate(problem, adjust_with_exact_robot(recording, problem))


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's solver."""
    yield SolverSpec(
        name="bundle_fixed",
        summary="reprojection bundle adjustment, robot poses exact",
        factory=lambda: bundle_fixed,
        needs=frozenset({Need.CORNERS, Need.INTRINSICS}),
        imports=("cv2",),
        reference="Tabb, Ahmad Yousef 2017, doi:10.1007/s00138-017-0841-7",
    )
