"""Tsai and Lenz 1989, "A new technique for fully autonomous and efficient 3D robotics hand/eye calibration"."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import Refusal
from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import Need, SolverSpec
from hecbench.system.wording import significant
from hecbench_plugins.markers.hand_eye import (
    PosedSamples,
    pose_pairs,
    rotation_diversity_deg,
    rotation_from_logs,
    to_estimate,
)
from hecbench_plugins.markers.opencv_hand_eye import hand_eye
from hecbench_plugins.markers.settings import HAND_EYE

_USABLE_SINE = 0.3, 1.7
"""OpenCV leaves out pairs whose 2 sin(angle / 2) lies outside; without pairs it returns the identity."""


def tsai(recording: Recording, *, rng: np.random.Generator) -> Estimate:
    """Rotation from modified Rodrigues vectors (eq. 12), then translation by least squares (eq. 15).

    The parametrisation is singular where X turns by 180 deg, a common mounting, so the camera frame is first
    turned by the cube rotation that brings X nearest to the identity, and turned back afterwards.
    """
    import cv2

    pairs = pose_pairs(recording)
    usable = _require_usable_pairs(pairs)
    turn = _nearest_cube_rotation(rotation_from_logs(pairs))
    turned = PosedSamples(pairs.hand, turn @ pairs.camera_T_target)
    parent_T_camera = hand_eye(turned, cv2.CALIB_HAND_EYE_TSAI) @ turn
    return to_estimate(
        pairs, parent_T_camera, diagnostics={"pairs_used": usable, "pairs": len(pairs.motions[0])}
    )


def _require_usable_pairs(pairs: PosedSamples) -> int:
    """How many pairs OpenCV will use.

    Raises:
        Refusal: they do not rotate about two axes.
    """
    logs_A, logs_B = pairs.rotation_logs
    sines = 2 * np.sin(np.linalg.norm([logs_A, logs_B], axis=-1) / 2)
    usable = ((sines > _USABLE_SINE[0]) & (sines < _USABLE_SINE[1])).all(0)
    second = np.append(rotation_diversity_deg(logs_A[usable]), 0.0)[1] if usable.any() else 0.0
    if second < HAND_EYE.least_rotation_deg:
        raise Refusal(
            f"only {usable.sum()} of {len(usable)} pairs turn by 17 to 116 deg, the range this method uses, "
            f"and by {significant(second)} deg rms about their second axis: add samples tilted by 20 to 60 deg"
        )
    return int(usable.sum())


def _nearest_cube_rotation(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """The transform (4, 4) of the one of the cube's 24 rotations that is nearest to a rotation (3, 3)."""
    from scipy.spatial.transform import Rotation

    cube = Rotation.create_group("O").as_matrix()
    return se3.make(cube[np.argmax(np.einsum("kij,ij->k", cube, rotation))], np.zeros(3))


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's solver."""
    yield SolverSpec(
        name="tsai",
        summary="AX = XB, separable, Rodrigues vectors",
        factory=lambda: tsai,
        needs=frozenset({Need.TARGET_POSES}),
        imports=("cv2",),
        reference="Tsai, Lenz 1989, doi:10.1109/70.34770",
    )
