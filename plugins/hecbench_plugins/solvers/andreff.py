"""Andreff, Horaud and Espiau 1999, "On-line hand-eye calibration": one linear system for rotation and
translation.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import Need, SolverSpec
from hecbench_plugins.markers.hand_eye import pose_pairs, to_estimate
from hecbench_plugins.markers.opencv_hand_eye import hand_eye


def andreff(recording: Recording, *, rng: np.random.Generator) -> Estimate:
    """Rotation and translation at once from the Kronecker form of AX = XB (eq. 10), then projected onto
    SO(3).
    """
    import cv2

    pairs = pose_pairs(recording)
    return to_estimate(pairs, hand_eye(pairs, cv2.CALIB_HAND_EYE_ANDREFF))


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's solver."""
    yield SolverSpec(
        name="andreff",
        summary="AX = XB, simultaneous, linear (Kronecker)",
        factory=lambda: andreff,
        needs=frozenset({Need.TARGET_POSES}),
        imports=("cv2",),
        reference="Andreff, Horaud, Espiau 1999, doi:10.1109/IM.1999.805374",
    )
