"""Park and Martin 1994, "Robot sensor calibration: solving AX = XB on the Euclidean group"."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from hecbench import se3
from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import Need, SolverSpec
from hecbench_plugins.markers.hand_eye import (
    pose_pairs,
    rotation_from_logs,
    to_estimate,
    translation_given_rotation,
)
from hecbench_plugins.markers.opencv_hand_eye import hand_eye


def park(recording: Recording, *, rng: np.random.Generator) -> Estimate:
    """Rotation from the polar factor of the paired rotation logs (eq. 25), then translation by least squares."""
    import cv2

    pairs = pose_pairs(recording)
    parent_T_camera = hand_eye(pairs, cv2.CALIB_HAND_EYE_PARK)
    reflected = bool(np.linalg.det(parent_T_camera[:3, :3]) < 0)
    if reflected:
        rotation = rotation_from_logs(pairs)
        parent_T_camera = se3.make(rotation, translation_given_rotation(pairs, rotation))
    return to_estimate(pairs, parent_T_camera, diagnostics={"reflection_corrected": reflected})


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's solver."""
    yield SolverSpec(
        name="park",
        summary="AX = XB on the Lie algebra, separable",
        factory=lambda: park,
        needs=frozenset({Need.TARGET_POSES}),
        imports=("cv2",),
        reference="Park, Martin 1994, doi:10.1109/70.326576",
    )
