"""How still the best constant X and Y hold the target: the measure by which conventions are proven."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.se3 import Array
from hecbench.system.wording import significant

_MOST_FITTED = 40
_SECOND_AXIS_RAD = np.deg2rad(2.0)
"""Rms turn about the second axis below which noise, not motion, chooses between directions."""


@dataclass(frozen=True)
class Stillness:
    """Rms deviations of the target's constant pose, and relative to how much the data move."""

    rotation_deg: float
    translation_mm: float
    relative: float

    def __str__(self) -> str:
        return f"{significant(self.rotation_deg, 3)} deg, {significant(self.translation_mm, 3)} mm"


def rotation_misfits(hands: Sequence[Array], targets: Sequence[Array]) -> Array:
    """How little the turns of each hand (N, 4, 4) agree with those of each target, (hands, targets), 0 to about 1.

    What Park and Martin's rotation (Arun 1987's solution) leaves of the turns between poses one and two rows apart.
    """
    A, B = (np.array([_near_turns(poses) for poses in stream]) for stream in (hands, targets))
    u, values, v = np.linalg.svd(np.einsum("imk,jml->ijkl", A, B))
    values[..., 2] *= np.sign(np.linalg.det(u) * np.linalg.det(v))
    total = (A**2).sum((1, 2))[:, None] + (B**2).sum((1, 2))
    return np.asarray(np.sqrt(np.maximum(total - 2 * values.sum(-1), 0) / np.maximum(total, 1e-12)))


def _near_turns(poses: Array) -> Array:
    poses = poses[_pairs(len(poses))[0]]
    inverses = se3.inverse(poses)
    return np.concatenate([se3.so3_log((poses[k:] @ inverses[:-k])[:, :3, :3]) for k in (1, 2)])


def turns_about_one_axis(poses: Array) -> bool:
    """Whether all turns between poses (N, 4, 4) are about one axis, or there are none."""
    turns = se3.so3_log(_relative(poses)[:, :3, :3])
    second = np.linalg.svd(turns, compute_uv=False)[1] / np.sqrt(len(turns))
    return bool(second < _SECOND_AXIS_RAD)


def _relative(poses: Array) -> Array:
    """Motions (M, 4, 4) between all pairs of at most 40 of the poses."""
    chosen, i, j = _pairs(len(poses))
    return np.asarray(poses[chosen][j] @ se3.inverse(poses[chosen][i]))


def _pairs(count: int) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    chosen = np.unique(np.linspace(0, count - 1, min(count, _MOST_FITTED)).astype(int))
    return chosen, *np.triu_indices(len(chosen), 1)


def stillness(hand: Array, camera_T_target: Array) -> Stillness:
    """How still the best constant X and Y hold the target, for hand poses (N, 4, 4) m.

    Relative is the larger of how still the target stands for the robot and how still the camera does, so
    that turning both streams round changes nothing. X by Park and Martin 1994, eq. 12 and 20, over all pairs
    of at most 40 samples.
    """
    rotation, left, right, scaled = _equations(hand, camera_T_target)
    translation = np.linalg.lstsq(left, scaled - right, rcond=None)[0] if len(left) else np.zeros(3)
    inverse_hand = se3.inverse(hand)
    target_T_camera = se3.inverse(camera_T_target)
    carrier_T_target = inverse_hand @ se3.make(rotation, translation) @ camera_T_target
    parent_T_camera = hand @ se3.mean(carrier_T_target) @ target_T_camera
    angle, distance = _rms_deviations(carrier_T_target)
    relative = max(
        deviation / max(extent, 1e-9)
        for constant, moving in ((carrier_T_target, camera_T_target), (parent_T_camera, target_T_camera))
        for deviation, extent in zip(_rms_deviations(constant), _rms_deviations(moving), strict=True)
    )
    return Stillness(float(np.rad2deg(angle)), 1e3 * distance, relative)


def _equations(hand: Array, camera_T_target: Array) -> tuple[Array, Array, Array, Array]:
    """The rotation of X, and of its translation t: ``left @ t = scaled - right``, scaled by the target's lengths."""
    A, B = _relative(hand), _relative(camera_T_target)
    turns_A, turns_B = se3.so3_log(A[:, :3, :3]), se3.so3_log(B[:, :3, :3])
    rotation = se3.nearest_rotation(turns_A.T @ turns_B)
    left = (A[:, :3, :3] - np.eye(3)).reshape(-1, 3)
    return rotation, left, A[:, :3, 3].ravel(), (B[:, :3, 3] @ rotation.T).ravel()


def length_factor(hand: Array, camera_T_target: Array) -> float:
    """By how much the target's lengths must grow for the motions to agree best."""
    _, left, right, scaled = _equations(hand, camera_T_target)
    return float(np.linalg.lstsq(np.column_stack([left, -scaled]), -right, rcond=None)[0][3])


def _rms_deviations(poses: Array) -> tuple[float, float]:
    """Rms deviations (rad, m) of poses (N, 4, 4) from their chordal mean."""
    mean = se3.mean(poses)
    angles, distances = se3.rotation_error_rad(mean, poses), se3.translation_error_m(mean, poses)
    return float(np.sqrt(np.mean(angles**2))), float(np.sqrt(np.mean(distances**2)))
