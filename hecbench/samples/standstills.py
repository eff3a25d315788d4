"""Samples of one robot pose: their errors are shared, so that together they count once."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hecbench import se3
from hecbench.recording import Recording
from hecbench.samples.agreement import share_left
from hecbench.se3 import Array

Labels = NDArray[np.int64]

STILL_M = 2e-4
STILL_RAD = np.deg2rad(0.02)
"""What encoders and controllers of a standing arm read differently at most."""
_STILL_SHARE = 0.05
"""Of the target's motion between robot poses that it may move at one of them."""


def standstills(base_T_flange: Array) -> Labels:
    """The number (N,) of each sample's robot pose (N, 4, 4) m: equal for samples at which the arm stood alike.

    Samples without a pose (NaN) are each their own.
    """
    count = len(base_T_flange)
    known = np.flatnonzero(np.isfinite(base_T_flange).all((1, 2)))
    rotations = base_T_flange[known, :3, :3].reshape(-1, 9) / (np.sqrt(2) * STILL_RAD)
    places = np.concatenate([base_T_flange[known, :3, 3] / STILL_M, rotations], 1)
    if _all_apart(places):
        return np.arange(count)

    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    near = cKDTree(places).query_pairs(1.0, output_type="ndarray")
    links = coo_array((np.ones(len(near)), (known[near[:, 0]], known[near[:, 1]])), (count, count))
    return np.asarray(connected_components(links, directed=False)[1], np.int64)


def _all_apart(places: Array) -> bool:
    """Whether each of the places (N, D) is more than 1 from all others along some axis; False may be wrong."""
    near = np.ones(len(places), bool)
    for along in places.T:
        order = np.argsort(along)
        close = np.diff(along[order]) <= 1
        beside = np.zeros(len(places), bool)
        beside[order[:-1][close]] = beside[order[1:][close]] = True
        near &= beside
    return not near.any()


def pose_labels(recording: Recording, indices: ArrayLike) -> Labels:
    """The number of the robot pose of each of these samples; each its own where no poses are known."""
    chosen = np.asarray(indices, int)
    if recording.base_T_flange is None:
        return np.arange(len(chosen))
    return standstills(recording.base_T_flange[chosen])


def folds(recording: Recording, indices: ArrayLike, most: int, rng: np.random.Generator) -> list[Labels]:
    """At most `most` sets of these samples; those of one robot pose share its error and stay together."""
    chosen = np.asarray(indices, int)
    labels = pose_labels(recording, chosen)
    groups = [chosen[labels == label] for label in np.unique(labels)]
    parts = np.array_split(rng.permutation(len(groups)), min(most, len(groups)))
    return [np.concatenate([groups[i] for i in part]) for part in parts if len(part)]


def one_per_robot_pose(recording: Recording) -> Recording:
    """One sample per robot pose, with the means of its corners and poses; as it is where none is repeated.

    Samples whose target moved although the arm is said to have stood still stay apart.
    """
    poses = recording.base_T_flange
    if poses is None:
        return recording
    labels = standstills(poses)
    if len(np.unique(labels)) == len(labels) or not _target_is_still(recording, labels):
        return recording
    _, firsts, labels = np.unique(labels, return_index=True, return_inverse=True)
    order = np.argsort(firsts)
    groups = [np.flatnonzero(labels == k) for k in order]
    changes: dict[str, Any] = {"base_T_flange": _mean_poses(poses, groups)}
    if recording.camera_T_target is not None:
        changes["camera_T_target"] = _mean_poses(recording.camera_T_target, groups)
    if recording.corners_px is not None:
        changes["corners_px"] = np.array([_mean_corners(recording.corners_px[group]) for group in groups])
    return replace(recording.subset(firsts[order]), **changes)


def _target_is_still(recording: Recording, labels: Labels) -> bool:
    """Whether the target moves between robot poses, and hardly at any of them."""
    if recording.corners_px is not None:
        seen = np.array([_centre(corners) for corners in recording.corners_px])
    elif recording.camera_T_target is not None:
        seen = recording.camera_T_target[:, :3, 3]
    else:
        return True
    seen, labels = seen[(known := np.isfinite(seen).all(1))], labels[known]
    if not len(seen):
        return True
    means = np.array([seen[labels == label].mean(0) for label in labels])
    repeated = np.bincount(labels)[labels] > 1
    if not repeated.any():
        return True
    left = np.linalg.norm(seen - means, axis=1)[repeated]
    return share_left(left, np.linalg.norm(seen - np.median(seen, axis=0), axis=1)) < _STILL_SHARE


def _centre(corners_px: Array) -> Array:
    seen = corners_px[np.isfinite(corners_px).all(1)]
    return seen.mean(0) if len(seen) else np.full(2, np.nan)


def _mean_poses(poses: Array, groups: list[Labels]) -> Array:
    known = [poses[group][np.isfinite(poses[group]).all((1, 2))] for group in groups]
    return np.array([se3.mean(some) if len(some) else np.full((4, 4), np.nan) for some in known])


def _mean_corners(corners_px: Array) -> Array:
    """(P, 2) of (N, P, 2), NaN where a point was never seen."""
    seen = np.isfinite(corners_px)
    return np.where(seen.any(0), np.where(seen, corners_px, 0).sum(0) / np.maximum(seen.sum(0), 1), np.nan)
