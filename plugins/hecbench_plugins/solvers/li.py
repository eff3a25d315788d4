"""Li, Wang and Wu 2010, "Simultaneous robot-world and hand-eye calibration": one linear system for AX = ZB."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import Need, SolverSpec
from hecbench_plugins.markers.hand_eye import pose_pairs, to_estimate
from hecbench_plugins.markers.opencv_hand_eye import robot_world


def li(recording: Recording, *, rng: np.random.Generator) -> Estimate:
    """Both transforms at once from the Kronecker form of AX = ZB, then both rotations projected onto SO(3)."""
    import cv2

    pairs = pose_pairs(recording)
    return to_estimate(pairs, *robot_world(pairs, cv2.CALIB_ROBOT_WORLD_HAND_EYE_LI))


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's solver."""
    yield SolverSpec(
        name="li",
        summary="AX = ZB, simultaneous, linear (Kronecker)",
        factory=lambda: li,
        needs=frozenset({Need.TARGET_POSES}),
        imports=("cv2",),
        reference="Li, Wang, Wu 2010, Int. J. Phys. Sci. 5(10):1530-1536",
    )
