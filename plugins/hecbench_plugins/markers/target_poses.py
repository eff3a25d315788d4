"""camera_T_target from corners: PnP, both planar solutions kept until the hand motion decides.

A small planar target seen through a perspective camera has two poses of nearly equal reprojection error
(Collins and Bartoli 2014, "Infinitesimal plane-based pose estimation", section 4). Which one is right cannot
be told from one image, but a motion turns hand and target by the same angle whatever the calibration is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import Refusal
from hecbench.recording import CameraModel, Recording

Array = NDArray[np.float64]

MINIMUM_POINTS = 4
_PIXEL_SIGMA_PX = 0.5
_ANGLE_SIGMA_RAD = np.deg2rad(1.0)
_ROBUST_LIMIT = 25.0
"""A pair of samples costs at most (5 sigma)^2, so that one bad robot pose does not decide for the others."""


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
        raise Refusal(f"no sample shows {MINIMUM_POINTS} or more target points")
    choice = np.zeros(len(recording), int)
    if recording.base_T_flange is not None and recording.corners_px is not None:
        hand = recording.hand_poses()
        decidable = seen & np.isfinite(hand).all((1, 2))
        points = np.isfinite(recording.corners_px).all(-1).sum(-1)
        misfit = points[:, None] * (errors_px / _PIXEL_SIGMA_PX) ** 2
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
    poses = np.full((len(recording), 2, 4, 4), np.nan)
    errors_px = np.full((len(recording), 2), np.nan)
    for i, corners_px in enumerate(corners):
        seen = np.isfinite(corners_px).all(1)
        if seen.sum() >= MINIMUM_POINTS:
            found = _pnp(target.points_m[seen], corners_px[seen], camera, target.is_planar)
            for k in range(2 if found else 0):
                poses[i, k], errors_px[i, k] = found[min(k, len(found) - 1)]
    return poses, errors_px


def project(camera: CameraModel, camera_T_target: Array, points_m: Array) -> Array:
    """Pixels (P, 2) of target points (P, 3) m, with the camera's distortion."""
    import cv2

    rotvec, translation = se3.so3_log(camera_T_target[:3, :3]), camera_T_target[:3, 3]
    pixels, _ = cv2.projectPoints(points_m, rotvec, translation, camera.K, camera.distortion)
    return np.asarray(pixels[:, 0])


def rays(camera: CameraModel, pixels: Array) -> Array:
    """Points (M, 3) at depth 1 in the camera's frame that pixels (M, 2) show, with the distortion undone."""
    import cv2

    until = (cv2.TERM_CRITERIA_MAX_ITER | cv2.TERM_CRITERIA_EPS, 100, 1e-10)
    undistorted = cv2.undistortPointsIter(
        pixels[:, None], camera.K, camera.distortion, np.eye(3), np.eye(3), until
    )
    return np.asarray(np.c_[undistorted[:, 0], np.ones(len(pixels))])


def _pnp(points_m: Array, corners_px: Array, camera: CameraModel, planar: bool) -> list[tuple[Array, float]]:
    """Refined (camera_T_target, rms reprojection error px), best first: up to two for a planar target, else
    one.
    """
    import cv2

    method = cv2.SOLVEPNP_IPPE if planar else cv2.SOLVEPNP_SQPNP
    intrinsics = camera.K, camera.distortion
    try:
        _, rotvecs, translations, _ = cv2.solvePnPGeneric(points_m, corners_px, *intrinsics, flags=method)
    except cv2.error:  # collinear points have no pose: the sample counts as not seen
        return []
    found = []
    for rotvec, translation in zip(rotvecs, translations, strict=True):
        rotvec, translation = cv2.solvePnPRefineLM(points_m, corners_px, *intrinsics, rotvec, translation)
        camera_T_target = se3.from_rotvec(rotvec[:, 0], translation[:, 0])
        if np.isfinite(camera_T_target).all() and camera_T_target[2, 3] > 0:
            residuals_px = project(camera, camera_T_target, points_m) - corners_px
            found.append((camera_T_target, float(np.sqrt((residuals_px**2).sum(1).mean()))))
    return sorted(found, key=lambda pose_and_error: pose_and_error[1])


def choose_by_motion(hand: Array, candidates: Array, misfit: Array) -> NDArray[np.int64]:
    """Which of two target poses each sample has, so that hand and target turn by the same angles.

    Minimises the sum over pairs of the squared difference of rotation angles, each limited, plus the
    reprojection errors: coordinate descent from the best-reprojecting choice and from the choice that agrees
    best with each single candidate.

    Args:
        hand: H (N, 4, 4) m.
        candidates: camera_T_target (N, 2, 4, 4) m.
        misfit: (N, 2) sums of squared reprojection errors over their variance.

    Returns:
        (N,) of 0 or 1.
    """
    count = len(hand)
    pair_cost = _motion_costs(hand, candidates)
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

    return min((descend(start) for start in starts), key=energy)


def _motion_costs(hand: Array, candidates: Array) -> Array:
    """(N, 2, N, 2): squared difference of the angles by which hand and target turn between samples, limited."""
    count = len(hand)
    hand_angles = _pairwise_angles(hand[:, :3, :3])
    target_angles = _pairwise_angles(candidates[..., :3, :3].reshape(2 * count, 3, 3)).reshape(
        count, 2, count, 2
    )
    difference = (target_angles - hand_angles[:, None, :, None]) / _ANGLE_SIGMA_RAD
    costs = np.minimum(difference**2, _ROBUST_LIMIT)
    costs[np.arange(count), :, np.arange(count), :] = 0.0
    return np.asarray(costs)


def _pairwise_angles(rotations: Array) -> Array:
    """Angles (M, M) rad between rotations (M, 3, 3)."""
    flat = rotations.reshape(len(rotations), 9)
    return np.asarray(np.arccos(np.clip((flat @ flat.T - 1) / 2, -1, 1)))
