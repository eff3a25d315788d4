"""How well the photographs confirm the robot's contour: for recordings with neither a target nor masks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from hecbench import se3, statistics
from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.samples.standstills import pose_labels
from hecbench.se3 import Array
from hecbench.specs import EvaluatorSpec, Need, ResultSection
from hecbench_plugins.left_out import solve_folds

_NEEDS = frozenset({Need.IMAGES, Need.ROBOT_MODEL, Need.JOINTS, Need.INTRINSICS})
_FEWEST_SAMPLES = 6
"""A search without a start needs five photographs."""


def of_left_out_photographs(
    estimate: Estimate,
    recording: Recording,
    *,
    solve: Callable[[Recording], Estimate],
    rng: np.random.Generator,
) -> Mapping[str, Any]:
    """The contour drawn in left-out photographs at the pose solved from the others, 5-fold.

    `contour_px` is the rms, over photographs, of the distance between the drawn contour and the place where the image
    has it; `confirmed` the mean share of the contour that the image confirms. A fold on which the solver gives no
    answer is counted in `failed_folds` and predicts nothing.
    """
    photographed = [i for i, image in enumerate(recording.images or ()) if image is not None]
    solved, folds = solve_folds(recording, photographed, solve, rng)
    counts: dict[str, Any] = dict(folds)
    if not solved:
        return counts | {"samples": 0}
    used = [np.sort(fold.left_out) for fold in solved]
    rows = [
        agreement(recording.subset(left_out), fold.estimate)
        for left_out, fold in zip(used, solved, strict=True)
    ]
    distance_px, share = np.concatenate(rows).T
    known = np.isfinite(distance_px)
    distance_px, labels = distance_px[known], pose_labels(recording, np.concatenate(used))[known]
    counts |= {"samples": len(share), "confirmed": float(share.mean())}
    if not len(distance_px):
        return counts
    rms = statistics.clustered_rms(distance_px, labels.tolist())
    if np.isfinite(rms.low):
        counts["contour_px_interval"] = [rms.low, rms.high]
    return counts | {
        "contour_px": rms.value,
        "contour_px_median": float(np.median(distance_px)),
    }


def agreement(recording: Recording, estimate: Estimate) -> Array:
    """Rms distance of the contour, px, and the share confirmed (N, 2), for each photograph at an answer."""
    from hecbench_plugins.maskless.refinement import schedule
    from hecbench_plugins.maskless.solver import Photographs

    photographs = Photographs.of(recording)
    _, last = schedule(photographs.canvas.valid.shape[1])
    matcher = photographs.lines(last, photographs.canvas)
    pose = se3.inverse(estimate.pose)
    matcher.learn(pose, last.spacing)
    found = matcher(pose, last.spacing)
    return np.column_stack([found.view_rms_px, found.view_confirmed_share])


def _applies(recording: Recording) -> bool:
    offers = recording.offers()
    count = sum(image is not None for image in recording.images or ())
    has_other_ruler = recording.camera_T_target is not None or Need.MASKS in offers
    return offers >= _NEEDS and count >= _FEWEST_SAMPLES and not has_other_ruler


@hookimpl
def hecbench_evaluators() -> Iterable[EvaluatorSpec]:
    """This file's evaluator."""
    yield EvaluatorSpec(
        name="contour_held_out",
        summary="the robot's contour in left-out photographs, where there is neither a target nor a mask",
        imports=("cv2",),
        factory=lambda: of_left_out_photographs,
        into=ResultSection.HELD_OUT,
        applies=_applies,
    )
