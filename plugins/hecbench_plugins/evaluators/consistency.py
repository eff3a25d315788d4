"""How well a calibration closes its own loop: consistency with the samples it was made from, not accuracy."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np

from hecbench import se3
from hecbench.estimate import Estimate
from hecbench.lens import normalised
from hecbench.recording import CameraModel, Recording
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import EvaluatorSpec, Need, ResultSection
from hecbench_plugins.markers.hand_eye import PosedSamples, carrier_T_target_per_sample, rotation_spread_deg

_LEAST_RAYS = 3


def consistency(
    estimate: Estimate,
    recording: Recording,
    *,
    solve: Callable[[Recording], Estimate],
    rng: np.random.Generator,
) -> Mapping[str, float]:
    """Spread of the constant target pose over all samples, and reconstruction error of the target's points.

    The spreads are the standard deviations s_R and s_t of Strobl and Hirzinger 2006, "Optimal hand-eye calibration":
    for a given X the best rotation and translation of Y separate, and so do they.
    """
    X = estimate.pose
    hand = recording.hand_poses()
    usable = np.isfinite(hand).all((1, 2)) & np.isfinite(recording.present.camera_T_target).all((1, 2))
    targets = carrier_T_target_per_sample(
        PosedSamples(hand[usable], recording.present.camera_T_target[usable]), X
    )
    offsets = targets[:, :3, 3] - targets[:, :3, 3].mean(0)
    found = {
        "target_spread_deg": rotation_spread_deg(targets[:, :3, :3]),
        "target_spread_mm": 1e3 * float(np.sqrt((offsets**2).sum(1).mean())),
    }
    if {Need.CORNERS, Need.INTRINSICS} <= recording.offers():
        distances_m = reconstruction_errors_m(X, recording)
        if distances_m.size:
            found["rae_mm"] = 1e3 * float(distances_m.mean())
            found["rae_mean_square_mm2"] = 1e6 * float((distances_m**2).mean())
    return found


def reconstruction_errors_m(parent_T_camera: Array, recording: Recording) -> Array:
    """Distances (P',) m between the target's points and their reconstruction from the calibrated chain alone.

    Each point seen in three or more samples is triangulated from its rays in the frame of the target's carrier,
    ``inverse(H) @ X``; the pattern is then laid onto the points by the best rigid motion, so that no method's own
    estimate of the target's pose enters (RAE: Tabb and Ahmad Yousef 2017, section 5.3, there with that estimate).
    """
    present = recording.present
    camera, target, corners_px = (
        present.camera,
        present.target,
        present.corners_px,
    )
    hand = recording.hand_poses()
    known = np.flatnonzero(np.isfinite(hand).all((1, 2)))
    other_T_camera = se3.inverse(hand[known]) @ parent_T_camera
    corners_px = corners_px[known]
    seen = np.asarray(np.isfinite(corners_px).all(-1))
    directions = np.full((*seen.shape, 3), np.nan)
    directions[seen] = _rays(camera, corners_px[seen])
    directions = np.einsum("nij,npj->npi", other_T_camera[:, :3, :3], directions)
    enough = seen.sum(0) >= _LEAST_RAYS
    if enough.sum() < _LEAST_RAYS:
        return np.zeros(0)
    points = np.array(
        [
            _nearest_to_rays(other_T_camera[seen[:, k], :3, 3], directions[seen[:, k], k])
            for k in np.flatnonzero(enough)
        ]
    )
    pattern = target.points_m[enough]
    return np.asarray(np.linalg.norm(_aligned(pattern, points) - points, axis=1))


def _rays(camera: CameraModel, pixels: Array) -> Array:
    """Unit directions (M, 3) in the camera's frame of pixels (M, 2)."""
    rays = np.c_[normalised(camera, pixels), np.ones(len(pixels))]
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))


def _nearest_to_rays(origins: Array, directions: Array) -> Array:
    """The point (3,) with the least sum of squared distances to rays from (M, 3) along unit (M, 3)."""
    across = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    return np.asarray(np.linalg.solve(across.sum(0), np.einsum("mij,mj->i", across, origins)))


def _aligned(pattern: Array, points: Array) -> Array:
    """The pattern (P, 3) moved rigidly onto the points (P, 3), least squares (Kabsch 1976)."""
    centred, towards = pattern - pattern.mean(0), points - points.mean(0)
    rotation = se3.nearest_rotation(towards.T @ centred)
    return np.asarray(centred @ rotation.T + points.mean(0))


@hookimpl
def hecbench_evaluators() -> Iterable[EvaluatorSpec]:
    """This file's evaluator."""
    yield EvaluatorSpec(
        name="consistency",
        summary="spread of the target's pose; reconstruction of the target's points",
        factory=lambda: consistency,
        into=ResultSection.DIAGNOSTICS,
        applies=lambda recording: (
            recording.camera_T_target is not None and recording.base_T_flange is not None
        ),
    )
