"""Errors against a known parent_T_camera."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np

from hecbench import se3
from hecbench.estimate import Estimate
from hecbench.lens import normalised, project, same
from hecbench.recording import Mounting, Recording
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import EvaluatorSpec, ResultSection
from hecbench.workspace import apart_m, points_in_parent


def errors(
    estimate: Estimate,
    recording: Recording,
    *,
    solve: Callable[[Recording], Estimate],
    rng: np.random.Generator,
) -> Mapping[str, float]:
    """Camera centre, rotation, parent's origin in the camera, and displacement of workspace points.

    `tre_mm` judges the pose alone; `pair_tre_mm` the pose with the camera that the estimate brings. They differ only
    where the method changed the intrinsics, and then only the second is what a user of the pair meets.
    """
    estimated, true = estimate.pose, recording.present.truth_parent_T_camera
    inverses = se3.inverse(estimated), se3.inverse(true)
    found = {
        "translation_error_mm": 1e3 * float(se3.translation_error_m(estimated, true)),
        "rotation_error_deg": float(np.rad2deg(se3.rotation_error_rad(estimated, true))),
        "camera_T_parent_translation_error_mm": 1e3 * float(se3.translation_error_m(*inverses)),
    }
    if recording.base_T_flange is not None:
        points_m = points_in_parent(recording.base_T_flange, recording.mounting is Mounting.EYE_IN_HAND)
        found["tre_mm"] = 1e3 * float(apart_m(estimated, true, points_m))
        pair_m = pair_error_m(estimate, recording, points_m)
        if pair_m is not None:
            found["pair_tre_mm"] = 1e3 * pair_m
    return found


def pair_error_m(estimate: Estimate, recording: Recording, points_m: Array) -> float | None:
    """Rms displacement, m, of workspace points that are seen by the true pair and placed by the estimated one.

    The recording's camera at the true pose gives the pixel and the depth of a point (P, 3) m; the estimate's camera
    turns them into a point again, and its pose places it. Points outside the image are left out: a lens model says
    nothing there. None when no point is inside, or when a camera is not known.
    """
    true_camera, camera = recording.camera, estimate.camera or recording.camera
    estimated, true = estimate.pose, recording.present.truth_parent_T_camera
    if true_camera is None or camera is None or true_camera.K is None or camera.K is None:
        return None
    if same(camera, true_camera):
        return float(apart_m(estimated, true, points_m))
    in_camera = se3.transform_points(se3.inverse(true), points_m)
    points_m, in_camera = points_m[in_camera[:, 2] > 0], in_camera[in_camera[:, 2] > 0]
    if not len(in_camera):
        return None
    pixels = project(true_camera, in_camera)
    inside = ((pixels >= 0) & (pixels <= [true_camera.width - 1, true_camera.height - 1])).all(1)
    if not inside.any():
        return None
    seen_again = in_camera[inside, 2:] * np.c_[normalised(camera, pixels[inside]), np.ones(inside.sum())]
    displacements_m = se3.transform_points(estimated, seen_again) - points_m[inside]
    return float(np.sqrt((displacements_m**2).sum(1).mean()))


@hookimpl
def hecbench_evaluators() -> Iterable[EvaluatorSpec]:
    """This file's evaluator."""
    yield EvaluatorSpec(
        name="errors",
        summary="errors against the true camera pose",
        factory=lambda: errors,
        into=ResultSection.ERRORS,
        applies=lambda recording: recording.truth_parent_T_camera is not None,
    )
