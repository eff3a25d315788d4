"""The hand-eye equation ``camera_T_target_i = inverse(X) @ H_i @ Y`` and what every solver of it shares.

X = parent_T_camera and Y = carrier_T_target are constant; the hand poses H fold both mountings into one model
(`Recording.hand_poses`). For two samples, ``A X = X B`` with the motions of `relative_motions`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import Refusal, SolverFailure
from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.samples.agreement import contradiction
from hecbench.samples.standstills import one_per_robot_pose
from hecbench.se3 import Array
from hecbench.system.wording import significant
from hecbench_plugins.markers.settings import HAND_EYE
from hecbench_plugins.markers.target_poses import target_poses


@dataclass(frozen=True, eq=False)
class PosedSamples:
    """The samples that have both poses.

    Attributes:
        hand: H (N, 4, 4) m.
        camera_T_target: (N, 4, 4) m.
    """

    hand: Array
    camera_T_target: Array

    def __len__(self) -> int:
        return len(self.hand)

    def subset(self, indices: NDArray[np.integer]) -> PosedSamples:
        """Only these samples."""
        return PosedSamples(self.hand[indices], self.camera_T_target[indices])

    @cached_property
    def compared(self) -> PosedSamples:
        """The samples whose motions are formed: these, or 800 evenly spread ones of more."""
        if len(self) <= HAND_EYE.most_compared:
            return self
        return self.subset(np.linspace(0, len(self) - 1, HAND_EYE.most_compared).astype(int))

    @cached_property
    def motions(self) -> tuple[Array, Array]:
        """A and B, each (M (M - 1) / 2, 4, 4), for all pairs i < j of the M compared, with ``A X = X B``."""
        hand, seen = self.compared.hand, self.compared.camera_T_target
        i, j = np.triu_indices(len(hand), 1)
        return hand[j] @ se3.inverse(hand[i]), seen[j] @ se3.inverse(seen[i])

    @cached_property
    def rotation_logs(self) -> tuple[Array, Array]:
        """Rotation vectors (pairs, 3) rad of A and of B."""
        A, B = self.motions
        return se3.so3_log(A[:, :3, :3]), se3.so3_log(B[:, :3, :3])


def pose_pairs(recording: Recording) -> PosedSamples:
    """The samples with a hand pose and a target pose, once they are known to determine X; one per robot pose.

    They are sorted by hand pose, whatever order they were taken in: the motions of a pair and of its reverse
    weigh translation noise differently, so methods on motions would otherwise depend on the order of the
    samples.

    Raises:
        Refusal: too few samples, or the hand does not rotate about two axes.
    """
    hand, camera_T_target = posed_samples(recording)
    order = np.lexsort(hand[:, :3].reshape(len(hand), -1).T)
    pairs = PosedSamples(hand[order], camera_T_target[order])
    require_two_rotation_axes(pairs)
    return pairs


def posed_samples(recording: Recording) -> tuple[Array, Array]:
    """H and camera_T_target, each (N, 4, 4) m, of the samples that have both; one per robot pose.

    Raises:
        Refusal: fewer than 3.
    """
    posed = replace(recording, camera_T_target=target_poses(recording))
    both = _both(posed)
    posed = posed.subset(np.flatnonzero(both)) if both.any() else posed
    once = one_per_robot_pose(posed)
    both = _both(once)
    if both.sum() < HAND_EYE.least_samples <= len(posed):
        raise Refusal(f"the hand hardly rotates: {len(posed)} samples stand at {both.sum()} robot poses")
    if both.sum() < HAND_EYE.least_samples:
        raise Refusal(
            f"{both.sum()} samples have a robot and a target pose; at least {HAND_EYE.least_samples} are needed"
        )
    return once.hand_poses()[both], once.present.camera_T_target[both]


def _both(recording: Recording) -> NDArray[np.bool_]:
    """Which samples have a robot pose and a target pose."""
    known = np.isfinite(recording.hand_poses()).all((1, 2))
    return np.asarray(known & np.isfinite(recording.present.camera_T_target).all((1, 2)))


def rotation_diversity_deg(rotation_logs: Array) -> Array:
    """Rms rotation (3,) deg about the principal axes, largest first, of the motions' rotation vectors (P, 3)."""
    return np.asarray(
        np.rad2deg(np.linalg.svd(rotation_logs, compute_uv=False)) / np.sqrt(len(rotation_logs))
    )


def require_two_rotation_axes(pairs: PosedSamples) -> None:
    """Raise `Refusal` unless the samples are enough and both hand and target rotate about two axes.

    With one axis only, the translation along it is unobservable to every method (Tsai and Lenz 1989, section
    III).
    """
    if len(pairs) < HAND_EYE.least_samples:
        raise Refusal(f"{len(pairs)} samples are left; at least {HAND_EYE.least_samples} are needed")
    for name, logs in zip(("hand", "target"), pairs.rotation_logs, strict=True):
        first, second, _ = np.append(rotation_diversity_deg(logs), 0.0)[:3]
        if first < HAND_EYE.least_rotation_deg:
            raise Refusal(
                f"the {name} hardly rotates ({significant(first)} deg rms): tilt it by 20 deg or more between samples"
            )
        if second < HAND_EYE.least_rotation_deg:
            raise Refusal(
                f"the {name} rotates about one axis only ({significant(first, 3)} deg rms, "
                f"{significant(second)} about others): "
                "add samples turned about a second axis"
            )


def carrier_T_target_per_sample(pairs: PosedSamples, parent_T_camera: Array) -> Array:
    """Y (N, 4, 4) as each sample sees it: ``inverse(H) @ X @ camera_T_target``; constant when all is exact."""
    return np.asarray(se3.inverse(pairs.hand) @ parent_T_camera @ pairs.camera_T_target)


def rotation_spread_deg(rotations: Array) -> float:
    """Rms deviation, deg, of rotations (N, 3, 3) from their chordal mean."""
    angles = se3.rotation_angle(se3.nearest_rotation(rotations.mean(0)).T @ rotations)
    return float(np.rad2deg(np.sqrt((angles**2).mean())))


def to_estimate(
    pairs: PosedSamples,
    parent_T_camera: Array,
    carrier_T_target: Array | None = None,
    diagnostics: Mapping[str, Any] | None = None,
) -> Estimate:
    """The estimate with its evidence: the spread of the constant target pose, and the diversity of the
    motion.

    Raises:
        Refusal: the answer is no rigid transform.
        SolverFailure: it contradicts the samples.
    """
    if not se3.is_transform(parent_T_camera):
        raise Refusal(
            "the equations gave a reflection, not a rotation: the noise exceeds the rotation; add samples"
        )
    carrier_T_targets = carrier_T_target_per_sample(pairs, parent_T_camera)
    if carrier_T_target is None:
        carrier_T_target = se3.mean(carrier_T_targets)
    spread_deg = rotation_spread_deg(carrier_T_targets[:, :3, :3])
    if reason := contradiction(pairs.hand, pairs.camera_T_target, parent_T_camera, carrier_T_target):
        raise SolverFailure(reason)
    offsets = carrier_T_targets[:, :3, 3] - carrier_T_targets[:, :3, 3].mean(0)
    evidence = {
        "samples": len(pairs),
        "samples_compared": len(pairs.compared),
        "target_spread_deg": spread_deg,
        "target_spread_mm": float(1e3 * np.sqrt((offsets**2).sum(1).mean())),
        "rotation_diversity_deg": rotation_diversity_deg(pairs.rotation_logs[0]).tolist(),
    }
    return Estimate(parent_T_camera, carrier_T_target, diagnostics=evidence | dict(diagnostics or {}))


def rotation_from_logs(pairs: PosedSamples) -> Array:
    """R_X (3, 3), the proper rotation nearest to ``sum log(R_A) log(R_B)^T`` (Park and Martin 1994, eq. 25)."""
    logs_A, logs_B = pairs.rotation_logs
    return se3.nearest_rotation(logs_A.T @ logs_B)


def translation_given_rotation(pairs: PosedSamples, rotation: Array) -> Array:
    """t_X (3,) m, least squares over all pairs of ``(R_A - I) t = R_X t_B - t_A`` (Tsai and Lenz 1989, eq.
    15).
    """
    A, B = pairs.motions
    left = (A[:, :3, :3] - np.eye(3)).reshape(-1, 3)
    right = (B[:, :3, 3] @ rotation.T - A[:, :3, 3]).reshape(-1)
    return np.asarray(np.linalg.lstsq(left, right, rcond=None)[0])
