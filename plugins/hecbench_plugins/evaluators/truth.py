"""Errors against a known parent_T_camera."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.estimate import Estimate
from hecbench.recording import Mounting, Recording
from hecbench.registry import hookimpl
from hecbench.specs import Column, EvaluatorSpec, ResultSection
from hecbench.workspace import cube_corners

Array = NDArray[np.float64]


def errors(
    estimate: Estimate,
    recording: Recording,
    *,
    solve: Callable[[Recording], Estimate],
    rng: np.random.Generator,
) -> Mapping[str, float]:
    """Camera centre, rotation, parent's origin in the camera, and displacement of workspace points."""
    estimated, true = estimate.parent_T_camera, recording.truth_parent_T_camera
    assert estimated is not None
    assert true is not None
    inverses = se3.inverse(estimated), se3.inverse(true)
    found = {
        "translation_error_mm": 1e3 * float(se3.translation_error_m(estimated, true)),
        "rotation_error_deg": float(np.rad2deg(se3.rotation_error_rad(estimated, true))),
        "camera_T_parent_translation_error_mm": 1e3 * float(se3.translation_error_m(*inverses)),
    }
    if recording.base_T_flange is not None:
        found["tre_mm"] = 1e3 * target_registration_error_m(estimated, true, recording)
    return found


def target_registration_error_m(estimated: Array, true: Array, recording: Recording) -> float:
    """Rms displacement, m, of the corners of a 0.4 m cube centred on the mean flange position.

    eye_to_hand: ``|X_est inverse(X_true) w - w|``; eye_in_hand: through each sample's flange pose B,
    ``|B X_est inverse(B X_true) w - w|``.
    """
    assert recording.base_T_flange is not None
    base_T_flange = recording.base_T_flange[np.isfinite(recording.base_T_flange).all((1, 2))]
    points_m = cube_corners(base_T_flange)
    error = estimated @ se3.inverse(true)
    if recording.mounting is Mounting.EYE_IN_HAND:
        error = base_T_flange @ error @ se3.inverse(base_T_flange)
    displacements_m = se3.transform_points(error, points_m) - points_m
    return float(np.sqrt((displacements_m**2).sum(-1).mean()))


@hookimpl
def hecbench_evaluators() -> Iterable[EvaluatorSpec]:
    """This file's ruler."""
    yield EvaluatorSpec(
        name="errors",
        summary="errors against the true camera pose",
        columns=(
            Column("translation_error_mm", "mm"),
            Column("rotation_error_deg", "deg"),
            Column("camera_T_parent_translation_error_mm", "mm"),
            Column("tre_mm", "mm"),
        ),
        factory=lambda: errors,
        into=ResultSection.ERRORS,
        applies=lambda recording: recording.truth_parent_T_camera is not None,
    )
