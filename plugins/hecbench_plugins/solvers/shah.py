"""Shah 2013, "Solving the robot-world/hand-eye calibration problem using the Kronecker product"."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import Need, SolverSpec
from hecbench_plugins.markers.hand_eye import pose_pairs, to_estimate
from hecbench_plugins.markers.opencv_hand_eye import robot_world


def shah(recording: Recording, *, rng: np.random.Generator) -> Estimate:
    """Both rotations from one singular vector pair, then both translations by least squares (AX = ZB)."""
    import cv2

    pairs = pose_pairs(recording)
    return to_estimate(pairs, *robot_world(pairs, cv2.CALIB_ROBOT_WORLD_HAND_EYE_SHAH))


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's solver."""
    yield SolverSpec(
        name="shah",
        summary="AX = ZB, separable (Kronecker)",
        factory=lambda: shah,
        needs=frozenset({Need.TARGET_POSES}),
        imports=("cv2",),
        reference="Shah 2013, doi:10.1115/1.4024473",
    )
