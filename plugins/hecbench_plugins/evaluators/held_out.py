"""How well a calibration predicts samples it has not seen: the evaluator for recordings without truth."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from hecbench import se3, statistics
from hecbench.estimate import Estimate
from hecbench.lens import same
from hecbench.recording import CameraModel, Recording
from hecbench.registry import hookimpl
from hecbench.samples.standstills import pose_labels
from hecbench.se3 import Array
from hecbench.specs import EvaluatorSpec, Need, ResultSection
from hecbench_plugins.left_out import solve_folds
from hecbench_plugins.markers.target_poses import project, target_poses


def held_out(
    estimate: Estimate,
    recording: Recording,
    *,
    solve: Callable[[Recording], Estimate],
    rng: np.random.Generator,
) -> Mapping[str, Any]:
    """Prediction of left-out samples, 5-fold by robot pose: rms with its bootstrap interval, median, each sample's.

    X is the solver's on the training folds. The evaluator itself refits Y = carrier_T_target there with the raw
    robot poses, identically for every solver, and predicts ``inverse(X) @ H @ Y`` for the left-out samples. A
    fold on which the solver gives no answer is counted in `failed_folds` and predicts nothing. A solver that changes
    the intrinsics is judged with its own camera: pixels are predicted by it, and what it saw is computed again by it.
    """
    hand = recording.hand_poses()
    usable = np.flatnonzero(
        np.isfinite(hand).all((1, 2)) & np.isfinite(recording.present.camera_T_target).all((1, 2))
    )
    residuals: dict[str, Array] = {}
    solved, counts = solve_folds(recording, usable, solve, rng)
    for fold in solved:
        pose = fold.estimate.pose
        seen_by = _seen_by(fold.estimate.camera or recording.camera, recording)
        carrier_T_target = refit_target(pose, seen_by.subset(fold.training))
        for i in fold.left_out.tolist():
            residuals[recording.sample_ids[i]] = _residuals(pose, carrier_T_target, seen_by, i)
    found: dict[str, Any] = {**counts, "samples": len(residuals)}
    answers = [fold.estimate.pose for fold in solved]
    if _solved_again(answers, estimate):
        found["fold_answers"] = [answer.tolist() for answer in answers]
    labels = pose_labels(recording, [recording.sample_ids.index(name) for name in residuals]).tolist()
    if len(set(labels)) < len(labels):
        found["robot_poses"] = dict(zip(residuals, labels, strict=True))
    columns = np.array(list(residuals.values())).T
    for name, values in zip(("reprojection_px", "target_mm", "target_deg"), columns, strict=False):
        if np.isfinite(values).all():
            rms = statistics.clustered_rms(values, labels)
            found[name] = rms.value
            if np.isfinite(rms.low):
                found[f"{name}_interval"] = [rms.low, rms.high]
            found[f"{name}_median"] = float(np.median(values))
            found[f"{name}_by_sample"] = dict(zip(residuals, values.tolist(), strict=True))
    return found


def _solved_again(answers: list[Array], estimate: Estimate) -> bool:
    """Whether the folds were solved on their own, so that their answers show how much the samples decide."""
    return any(not np.array_equal(answer, estimate.parent_T_camera) for answer in answers)  # type: ignore[arg-type]


def _seen_by(camera: CameraModel | None, recording: Recording) -> Recording:
    """The recording as another camera sees it: the same corners, the target poses that follow from them with it."""
    known = recording.camera
    if camera is None or known is None or not _has_pixels(recording) or same(camera, known):
        return recording
    other = replace(recording, camera=camera, camera_T_target=None)
    return replace(other, camera_T_target=target_poses(other))


def refit_target(parent_T_camera: Array, recording: Recording) -> Array:
    """Y (4, 4) given X: least reprojection error where there are corners, else the mean of what samples see."""
    present = recording.present
    from scipy.optimize import least_squares

    hand = recording.hand_poses()
    start = se3.mean(se3.inverse(hand) @ parent_T_camera @ present.camera_T_target)
    if not _has_pixels(recording):
        return start
    camera, points_m = present.camera, present.target.points_m
    seen = np.isfinite(present.corners_px).all(-1)
    observed_px = present.corners_px[seen]
    camera_T_other = se3.inverse(parent_T_camera) @ hand

    def residuals_px(twist: Array) -> Array:
        camera_T_target = camera_T_other @ se3.exp(twist) @ start
        points_camera = se3.transform_points(camera_T_target, points_m)[seen]
        return np.asarray((project(camera, np.eye(4), points_camera) - observed_px).ravel())

    twist = least_squares(residuals_px, np.zeros(6), method="lm", x_scale="jac").x
    return np.asarray(se3.exp(twist) @ start)


def _has_pixels(recording: Recording) -> bool:
    return {Need.CORNERS, Need.INTRINSICS} <= recording.offers()


def _residuals(parent_T_camera: Array, carrier_T_target: Array, recording: Recording, i: int) -> Array:
    """[rms px or NaN, mm, deg] of one sample."""
    present = recording.present
    predicted = se3.inverse(parent_T_camera) @ recording.hand_poses()[i] @ carrier_T_target
    observed = present.camera_T_target[i]
    pixels = np.nan
    if _has_pixels(recording):
        seen = np.isfinite(present.corners_px[i]).all(-1)
        offsets = project(present.camera, predicted, present.target.points_m[seen])
        pixels = np.sqrt(((offsets - present.corners_px[i][seen]) ** 2).sum(1).mean())
    millimetres = 1e3 * se3.translation_error_m(predicted, observed)
    return np.array([pixels, millimetres, np.rad2deg(se3.rotation_error_rad(predicted, observed))])


@hookimpl
def hecbench_evaluators() -> Iterable[EvaluatorSpec]:
    """This file's evaluator."""
    yield EvaluatorSpec(
        name="held_out",
        summary="prediction of left-out samples",
        factory=lambda: held_out,
        into=ResultSection.HELD_OUT,
        applies=lambda recording: (
            recording.camera_T_target is not None and recording.base_T_flange is not None
        ),
    )
