"""camera_T_target from corners: PnP, both planar solutions kept until the hand motion decides.

A small planar target seen through a perspective camera has two poses of nearly equal reprojection error
(Collins and Bartoli 2014, "Infinitesimal plane-based pose estimation", section 4). Which one is right cannot
be known from one image, but a motion turns hand and target by the same angle whatever the calibration is.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hecbench import lens, se3
from hecbench.bundle.pictures import refined
from hecbench.errors import Refusal
from hecbench.lens import FixedSensor, normalised
from hecbench.recording import CameraModel, Recording
from hecbench.se3 import Array
from hecbench.targets import Target
from hecbench_plugins.markers.settings import TARGET_POSES


def target_poses(recording: Recording) -> Array:
    """camera_T_target (N, 4, 4) m, NaN rows where the target is not seen; as given, else from `corners_px`.

    Raises:
        Refusal: neither poses nor corners with intrinsics and target are given.
    """
    if recording.camera_T_target is not None:
        return recording.camera_T_target
    poses, errors_px = planar_candidates(recording)
    seen = np.isfinite(poses[:, 0]).all((1, 2))
    if not seen.any():
        raise Refusal(f"no sample shows {TARGET_POSES.least_points} or more target points")
    choice = np.zeros(len(recording), int)
    if recording.base_T_flange is not None and recording.corners_px is not None:
        hand = recording.hand_poses()
        decidable = seen & np.isfinite(hand).all((1, 2))
        points = np.isfinite(recording.corners_px).all(-1).sum(-1)
        misfit = points[:, None] * (errors_px / TARGET_POSES.pixel_sigma_px) ** 2
        choice[decidable] = choose_by_motion(hand[decidable], poses[decidable], misfit[decidable])
    return poses[np.arange(len(recording)), choice]


def planar_candidates(recording: Recording) -> tuple[Array, Array]:
    """Both planar solutions of each sample, refined, best first; a sample with one solution repeats it.

    Returns:
        camera_T_target (N, 2, 4, 4) m and rms reprojection errors (N, 2) px; NaN where the target is not
        seen.
    """
    target, camera, corners = recording.target, recording.camera, recording.corners_px
    if target is None or camera is None or camera.K is None or corners is None:
        raise Refusal(
            "has no camera_T_target, and not all of corners_px, target and camera.K to compute it from"
        )
    return _planar_candidates(_Seen(target, camera, corners))


class _Seen:
    """What planar candidates depend on; equal by content, since several steps ask for those of the same pictures."""

    def __init__(self, target: Target, camera: CameraModel, corners_px: Array) -> None:
        self.target, self.camera, self.corners_px = target, camera, corners_px
        self._content = (
            target.points_m.tobytes(),
            camera.distortion_model,
            lens.parameters_of(camera).tobytes(),
            corners_px.tobytes(),
        )

    def __hash__(self) -> int:
        return hash(self._content)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Seen) and self._content == other._content


@lru_cache(maxsize=8)
def _planar_candidates(seen: _Seen) -> tuple[Array, Array]:
    target, camera, corners = seen.target, seen.camera, seen.corners_px
    poses = np.full((len(corners), 2, 4, 4), np.nan)
    errors_px = np.full((len(corners), 2), np.nan)
    ideal = normalised(camera, corners)
    found = [(i, pose) for i in range(len(corners)) for pose in _starts(target, ideal[i])]
    if not found:
        return poses, errors_px
    owners = np.array([i for i, _ in found])
    refined_poses, refined_px = refined(
        np.array([pose for _, pose in found]), target.points_m, corners[owners], FixedSensor(camera)
    )
    for i in np.unique(owners).tolist():
        own = np.flatnonzero((owners == i) & np.isfinite(refined_px))
        own = own[np.argsort(refined_px[own], kind="stable")]
        if len(own):
            best_first = own[[0, min(1, len(own) - 1)]]
            poses[i], errors_px[i] = refined_poses[best_first], refined_px[best_first]
    poses.flags.writeable = errors_px.flags.writeable = False
    return poses, errors_px


def project(camera: CameraModel, camera_T_target: Array, points_m: Array) -> Array:
    """Pixels (P, 2) of target points (P, 3) m, with the camera's distortion; NaN behind the camera."""
    return lens.project(camera, se3.transform_points(camera_T_target, points_m))


def _starts(target: Target, ideal: Array) -> list[Array]:
    """camera_T_target from ideal normalised coordinates (P, 2): up to two for a planar target, else one."""
    import cv2

    seen = np.isfinite(ideal).all(1)
    if seen.sum() < TARGET_POSES.least_points:
        return []
    method = cv2.SOLVEPNP_IPPE if target.is_planar else cv2.SOLVEPNP_SQPNP
    try:
        _, rotvecs, translations, _ = cv2.solvePnPGeneric(
            target.points_m[seen], ideal[seen], np.eye(3), None, flags=method
        )
    except cv2.error:  # collinear points have no pose: the sample counts as not seen
        return []
    poses = [se3.from_rotvec(r[:, 0], t[:, 0]) for r, t in zip(rotvecs, translations, strict=True)]
    return [pose for pose in poses if np.isfinite(pose).all() and pose[2, 3] > 0]


def choose_by_motion(hand: Array, candidates: Array, misfit: Array) -> NDArray[np.int64]:
    """Which of two target poses each sample has, so that hand and target turn by the same angles.

    Minimises the sum over pairs of the squared difference of rotation angles, each limited, plus the
    reprojection errors: coordinate descent from the best-reprojecting choice and from the choice that agrees
    best with each single candidate. Of many samples 60, evenly spaced, are chosen so, the others against them.

    Args:
        hand: H (N, 4, 4) m.
        candidates: camera_T_target (N, 2, 4, 4) m.
        misfit: (N, 2) sums of squared reprojection errors over their variance.

    Returns:
        (N,) of 0 or 1.
    """
    some = np.unique(np.linspace(0, len(hand) - 1, min(len(hand), TARGET_POSES.compared)).astype(int))
    pair_cost = _motion_costs(hand, candidates, some)
    chosen = _chosen_together(misfit[some], pair_cost[some])
    costs = misfit + pair_cost[:, :, np.arange(len(some)), chosen].sum(2)
    choice = costs.argmin(1)
    choice[some] = chosen
    return np.asarray(choice)


def _chosen_together(misfit: Array, pair_cost: Array) -> NDArray[np.int64]:
    """The choices (N,) that minimise misfit (N, 2) plus the costs (N, 2, N, 2) of all pairs."""
    count = len(misfit)
    each = np.arange(count)
    starts = [np.zeros(count, int), *(pair_cost[i, k].argmin(1) for i in range(count) for k in range(2))]

    def energy(choice: NDArray[np.int64]) -> float:
        return float(
            misfit[each, choice].sum() + pair_cost[each[:, None], choice[:, None], each, choice].sum() / 2
        )

    def descend(choice: NDArray[np.int64]) -> NDArray[np.int64]:
        for _ in range(2 * count):
            costs = misfit + pair_cost[:, :, each, choice].sum(2)
            gains = costs[each, choice] - costs[each, 1 - choice]
            best = int(gains.argmax())
            if gains[best] <= 1e-9:
                break
            choice = choice.copy()
            choice[best] = 1 - choice[best]
        return choice

    distinct = np.unique(np.array(starts), axis=0)
    return min((descend(start) for start in distinct), key=energy)


def _motion_costs(hand: Array, candidates: Array, others: NDArray[np.int64]) -> Array:
    """(N, 2, M, 2): squared difference of the angles by which hand and target turn from M others, limited."""
    count, compared = len(hand), len(others)
    hand_angles = _angles_between(hand[:, :3, :3], hand[others, :3, :3])
    rotations = candidates[..., :3, :3]
    target_angles = _angles_between(
        rotations.reshape(2 * count, 3, 3), rotations[others].reshape(2 * compared, 3, 3)
    ).reshape(count, 2, compared, 2)
    difference = (target_angles - hand_angles[:, None, :, None]) / TARGET_POSES.angle_sigma_rad
    costs = np.minimum(difference**2, TARGET_POSES.robust_limit)
    costs[others, :, np.arange(compared), :] = 0.0
    return np.asarray(costs)


def _angles_between(first: Array, second: Array) -> Array:
    """Angles (M, K) rad from rotations (M, 3, 3) to rotations (K, 3, 3)."""
    traces = first.reshape(len(first), 9) @ second.reshape(len(second), 9).T
    return np.asarray(np.arccos(np.clip((traces - 1) / 2, -1, 1)))
