"""The answers that are weighed, each with what it looks at and how wrong it may be."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hecbench import lens
from hecbench.estimate import Estimate, Status
from hecbench.recording import CameraModel, Need
from hecbench.se3 import Array
from hecbench.verdict.uncertainty import Uncertainty, uncertainty
from hecbench.workspace import apart_m

SILHOUETTE, CORNERS, TARGET_POSES = "silhouette", "corners", "target poses"
_REACH = 2.5
"""Combined standard deviations within which two answers agree."""


def evidence_of(needs: Collection[Need]) -> str:
    """What a solver with these needs looks at: the robot itself, the target's corners, or the target's poses."""
    if Need.ROBOT_MODEL in needs:
        return SILHOUETTE
    return CORNERS if Need.CORNERS in needs else TARGET_POSES


@dataclass(frozen=True, eq=False)
class Answer:
    """An estimate with an answer.

    Attributes:
        estimate: with parent_T_camera.
        X: parent_T_camera (4, 4).
        evidence: `SILHOUETTE`, `CORNERS` or `TARGET_POSES`.
        uncertainty: None where the method gives none and was not solved on folds.
        rms_m: expected error of the workspace points, infinite without an uncertainty.
        moved_camera: whether the method changed the recording's intrinsics.
    """

    estimate: Estimate
    X: Array
    evidence: str
    uncertainty: Uncertainty | None
    rms_m: float
    moved_camera: bool

    @property
    def solver(self) -> str:
        """Its name."""
        return self.estimate.solver

    @property
    def sees_target(self) -> bool:
        """Whether it looks at a target rather than at the robot."""
        return self.evidence != SILHOUETTE

    def has_covariance(self) -> bool:
        """Whether the method models its own errors."""
        return self.estimate.covariance is not None and self.uncertainty is not None


def answers_of(
    estimates: Sequence[Estimate],
    evidence: Mapping[str, str],
    camera: CameraModel | None,
    samples: int,
    points_m: Array,
) -> list[Answer]:
    """Of the estimates that have an answer, in their order.

    Args:
        estimates: of one recording.
        evidence: of each solver, see `evidence_of`.
        camera: the recording's.
        samples: of the recording.
        points_m: (P, 3) in the parent, where errors count.
    """
    found = []
    for estimate in estimates:
        if estimate.status is not Status.OK or estimate.parent_T_camera is None:
            continue
        known = uncertainty(estimate, samples, points_m)
        moved = camera is not None and estimate.camera is not None and not lens.same(estimate.camera, camera)
        rms_m = np.inf if known is None else known.rms_m(points_m)
        kind = evidence.get(estimate.solver, TARGET_POSES)
        found.append(Answer(estimate, estimate.parent_T_camera, kind, known, rms_m, moved))
    return found


def distance_m(first: Answer, second: Answer, points_m: Array) -> float:
    """Rms distance of workspace points between two answers."""
    return float(apart_m(first.X, second.X, points_m))


def agree(first: Answer, second: Answer, points_m: Array, tolerance_m: float) -> bool:
    """Whether two answers are as near as their uncertainties allow, or as the user needs.

    A method that is very uncertain agrees with everything and confirms nothing, so that the reach of the more certain
    one, or the user's tolerance, counts at most twice.
    """
    known = [answer.rms_m for answer in (first, second) if np.isfinite(answer.rms_m)]
    allowed_m = max(_REACH * float(np.linalg.norm(known)), tolerance_m)
    most_m = 2 * max(_REACH * min(known, default=0.0), tolerance_m)
    return distance_m(first, second, points_m) <= min(allowed_m, most_m)


def predicts_better(first: Estimate, second: Estimate, names: Sequence[str], seed: int = 0) -> bool:
    """Whether the first predicts left-out samples better than the second, by every one of these held-out numbers.

    Better is a mean difference of squared residuals, sample by sample, whose 95 % bootstrap interval excludes zero;
    samples of one robot pose count together.
    """
    from hecbench import statistics

    for name in names:
        one, two = (
            dict((estimate.held_out or {}).get(f"{name}_by_sample") or {}) for estimate in (first, second)
        )
        shared = [sample for sample in one if sample in two]
        if not shared:
            return False
        gain = [two[sample] ** 2 - one[sample] ** 2 for sample in shared]
        poses = (first.held_out or {}).get("robot_poses") or {}
        interval = statistics.cluster_bootstrap(gain, [poses.get(sample, sample) for sample in shared], seed)
        if not interval.low > 0:  # also where there are too few samples for an interval
            return False
    return True
