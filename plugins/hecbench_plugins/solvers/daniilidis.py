"""Daniilidis 1999, "Hand-eye calibration using dual quaternions"."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import Need, SolverSpec
from hecbench_plugins.markers.hand_eye import pose_pairs, to_estimate
from hecbench_plugins.markers.opencv_hand_eye import hand_eye, without_half_turns


def daniilidis(recording: Recording, *, rng: np.random.Generator) -> Estimate:
    """Rotation and translation at once from the null space of the dual-quaternion equations (eq. 31)."""
    import cv2

    pairs = pose_pairs(recording)
    chosen = without_half_turns(pairs)
    parent_T_camera = hand_eye(chosen, cv2.CALIB_HAND_EYE_DANIILIDIS)
    return to_estimate(pairs, parent_T_camera, diagnostics={"samples_used": len(chosen)})


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's solver."""
    yield SolverSpec(
        name="daniilidis",
        summary="AX = XB, simultaneous, dual quaternions",
        factory=lambda: daniilidis,
        needs=frozenset({Need.TARGET_POSES}),
        imports=("cv2",),
        reference="Daniilidis 1999, doi:10.1177/02783649922066213",
    )
