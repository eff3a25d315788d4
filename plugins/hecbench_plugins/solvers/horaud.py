"""Horaud and Dornaika 1995, "Hand-eye calibration": quaternion eigenproblem, then least squares."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import Need, SolverSpec
from hecbench_plugins.markers.hand_eye import pose_pairs, to_estimate
from hecbench_plugins.markers.opencv_hand_eye import hand_eye, without_half_turns


def horaud(recording: Recording, *, rng: np.random.Generator) -> Estimate:
    """Rotation as the eigenvector of a quaternion form (eq. 25), then translation by least squares."""
    import cv2

    pairs = pose_pairs(recording)
    chosen = without_half_turns(pairs)
    parent_T_camera = hand_eye(chosen, cv2.CALIB_HAND_EYE_HORAUD)
    return to_estimate(pairs, parent_T_camera, diagnostics={"samples_used": len(chosen)})


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's solver."""
    yield SolverSpec(
        name="horaud",
        summary="AX = XB, separable, quaternion eigenvector",
        factory=lambda: horaud,
        needs=frozenset({Need.TARGET_POSES}),
        imports=("cv2",),
        reference="Horaud, Dornaika 1995, doi:10.1177/027836499501400301",
    )
