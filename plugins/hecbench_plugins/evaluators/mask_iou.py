"""Overlap of the drawn robot with the masks: of an answer, of predictions of left-out views, and of the masks at the
truth.

An intersection over union is never a distance: how many millimetres it stands for depends on the view.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from hecbench import statistics
from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.samples.standstills import pose_labels
from hecbench.se3 import Array
from hecbench.specs import EvaluatorSpec, Need, ResultSection
from hecbench_plugins.left_out import solve_folds

_NEEDS = frozenset({Need.MASKS, Need.ROBOT_MODEL, Need.JOINTS, Need.INTRINSICS})


def overlaps(recording: Recording, parent_T_camera: Array, samples: Sequence[int]) -> list[float]:
    """Intersection over union of the robot drawn at a pose and the masks of these samples."""
    from hecbench_plugins.views.silhouettes import Silhouettes

    silhouettes = Silhouettes(recording)
    found = []
    for sample in samples:
        drawn, mask = silhouettes.draw(sample, parent_T_camera), recording.mask(sample)
        found.append(float((drawn & mask).sum() / max((drawn | mask).sum(), 1)))
    return found


def masked_samples(recording: Recording) -> list[int]:
    """The samples with joints and a mask."""
    has_joints = np.atleast_1d(np.isfinite(recording.present.joints_rad).all(1))
    return [i for i, mask in enumerate(recording.present.masks) if mask is not None and has_joints[i]]


def of_answer(
    estimate: Estimate,
    recording: Recording,
    *,
    solve: Callable[[Recording], Estimate],
    rng: np.random.Generator,
) -> Mapping[str, float]:
    """The robot drawn at the estimate against the masks that the solver got: mean and least over the samples."""
    found = overlaps(recording, estimate.pose, masked_samples(recording))
    return {"mask_iou": float(np.mean(found)), "mask_iou_least": min(found)}


def of_left_out_views(
    estimate: Estimate,
    recording: Recording,
    *,
    solve: Callable[[Recording], Estimate],
    rng: np.random.Generator,
) -> Mapping[str, Any]:
    """The robot drawn in left-out views at the pose solved from the others, 5-fold: mean, its interval, median.

    A fold on which the solver gives no answer is counted in `failed_folds` and predicts nothing.
    """
    solved, folds = solve_folds(recording, masked_samples(recording), solve, rng)
    found: list[float] = []
    used: list[int] = []
    for fold in solved:
        found += overlaps(recording, fold.estimate.pose, fold.left_out.tolist())
        used += fold.left_out.tolist()
    counts: dict[str, Any] = {**folds, "samples": len(found)}
    if not found:
        return counts
    mean = statistics.cluster_bootstrap(found, pose_labels(recording, used).tolist())
    if np.isfinite(mean.low):
        counts["mask_iou_interval"] = [mean.low, mean.high]
    return counts | {"mask_iou": mean.value, "mask_iou_median": float(np.median(found))}


def of_masks(
    estimate: Estimate,
    recording: Recording,
    *,
    solve: Callable[[Recording], Estimate],
    rng: np.random.Generator,
) -> Mapping[str, float]:
    """The masks against the robot drawn at the truth: mean over the samples. Says nothing of the estimate."""
    found = overlaps(recording, recording.present.truth_parent_T_camera, masked_samples(recording))
    return {"masks_iou_truth": float(np.mean(found))}


def _drawable(recording: Recording) -> bool:
    return recording.offers() >= _NEEDS and bool(masked_samples(recording))


@hookimpl
def hecbench_evaluators() -> Iterable[EvaluatorSpec]:
    """This file's evaluators."""
    yield EvaluatorSpec(
        name="mask_iou",
        summary="overlap of the robot drawn at the answer with the masks",
        factory=lambda: of_answer,
        into=ResultSection.DIAGNOSTICS,
        applies=_drawable,
    )
    yield EvaluatorSpec(
        name="mask_iou_held_out",
        summary="overlap of the robot drawn in left-out views with their masks, where there is no target",
        factory=lambda: of_left_out_views,
        into=ResultSection.HELD_OUT,
        applies=lambda recording: (
            recording.camera_T_target is None and _drawable(recording) and len(masked_samples(recording)) > 1
        ),
    )
    yield EvaluatorSpec(
        name="masks_iou_truth",
        summary="overlap of the masks with the robot drawn at the true camera pose",
        factory=lambda: of_masks,
        into=ResultSection.ERRORS,
        applies=lambda recording: recording.truth_parent_T_camera is not None and _drawable(recording),
    )
