"""Frozen streams: one target pose, or one robot pose, repeated while the other moves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity, names
from hecbench.diagnose.fit import LEAST_SAMPLES
from hecbench.recording import Recording
from hecbench.samples.standstills import one_per_robot_pose
from hecbench.se3 import Array

Samples = NDArray[np.bool_]

ID = "repeated_samples"
_ROBOT_MOVED_M = 2e-3
_ROBOT_MOVED_RAD = np.deg2rad(0.2)
"""More than repeated readings of a standing arm differ."""
_TARGET_MOVED_SHARE = 0.2
"""Of the target's typical motion in the recording: more than its noise."""


Moves = Callable[[NDArray[np.int64]], bool]
"""Whether something moves among these samples."""


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """Exact repeats of one stream while the other moves; what remains is examined with one sample per robot pose."""
    poses, seen = case.recording.base_T_flange, _seen(case.recording)
    if poses is None or seen is None:
        return None, case
    stale = _repeated(seen, lambda same: _robot_moves(poses[same]))
    if stale.any():
        return _finding(case, stale, "target", "robot")
    stale = _repeated(poses.reshape(len(poses), -1), lambda same: _target_moves(seen, same))
    if stale.any():
        return _finding(case, stale, "robot", "target")
    return None, replace(case, recording=one_per_robot_pose(case.recording))


def _seen(recording: Recording) -> Array | None:
    """What was seen of the target, as numbers (N, K): pixels, or the pose."""
    for values in (recording.corners_px, recording.camera_T_target):
        if values is not None:
            return values.reshape(len(values), -1)
    return None


def _repeated(rows: Array, moves: Moves) -> Samples:
    """Samples whose rows (N, K) are equal in every digit although the other stream moves among them."""
    known = np.flatnonzero(np.isfinite(rows).any(1))
    _, labels = np.unique(np.nan_to_num(rows[known], nan=np.inf), axis=0, return_inverse=True)
    stale = np.zeros(len(rows), bool)
    for label in np.flatnonzero(np.bincount(labels.ravel()) > 1):
        same = known[labels.ravel() == label]
        stale[same] = moves(same)
    return stale


def _robot_moves(poses: Array) -> bool:
    poses = poses[np.isfinite(poses).all((1, 2))]
    if len(poses) < 2:
        return False
    far = se3.translation_error_m(poses[0], poses) > _ROBOT_MOVED_M
    return bool((far | (se3.rotation_error_rad(poses[0], poses) > _ROBOT_MOVED_RAD)).any())


def _target_moves(seen: Array, same: NDArray[np.int64]) -> bool:
    complete = seen[np.isfinite(seen).all(1)]
    own = seen[same][np.isfinite(seen[same]).all(1)]
    if len(own) < 2:
        return False
    typical = float(np.median(np.linalg.norm(complete - np.median(complete, axis=0), axis=1)))
    return bool(np.linalg.norm(own - own[0], axis=1).max() > _TARGET_MOVED_SHARE * typical)


def _finding(case: Examination, stale: Samples, frozen: str, moving: str) -> tuple[Finding, Examination]:
    """The finding, and the case without the repeats where enough remains."""
    concerned = tuple(case.recording.sample_ids[i] for i in np.flatnonzero(stale).tolist())
    summary = f"the {frozen}'s pose is frozen: samples {names(concerned)} repeat it while the {moving} moves"
    action = f"leave these samples out; record again with fresh readings of the {frozen} (a stale transform, a cache)"
    finding = Finding(ID, Severity.CRITICAL, summary, action, float(stale.sum()), 0.0, concerned)
    rest = np.flatnonzero(~stale)
    if len(rest) <= LEAST_SAMPLES:
        return finding, replace(case, judged=False)
    return finding, replace(case, recording=one_per_robot_pose(case.recording.subset(rest)))
