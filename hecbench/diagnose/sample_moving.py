"""Samples taken while the arm moved: image and robot pose are of different moments."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hecbench import se3
from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity, names
from hecbench.diagnose.joints_vs_pose import agreement
from hecbench.se3 import Array
from hecbench.system.wording import significant

ID = "sample_moving"
LIMIT_MM = 2.0
LIMIT_DEG = 0.2
LIMIT_LAG_S = 0.05
FARTHEST_MM = 150.0
FARTHEST_DEG = 15.0
"""Joints and pose farther apart are of other samples, not of other moments."""
_TIMES_TYPICAL = 6.0
_CURE = "wait until the arm stands still before taking image and pose, and record these samples again"


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """Joints against poses, and the stamps of camera and robot against the arm's speed between samples."""
    finding = _by_joints(case) or _by_stamps(case)
    if finding is None:
        return None, case
    return finding, replace(case, explained=case.explained | frozenset(finding.samples))


def _by_joints(case: Examination) -> Finding | None:
    found = agreement(case)
    if found is None or not found.holds:
        return None
    typical_deg, typical_mm = found.typical
    off = (found.millimetres > max(LIMIT_MM, _TIMES_TYPICAL * typical_mm)) | (
        found.degrees > max(LIMIT_DEG, _TIMES_TYPICAL * typical_deg)
    )
    off &= (found.millimetres < FARTHEST_MM) & (found.degrees < FARTHEST_DEG)
    if not off.any():
        return None
    concerned = tuple(case.recording.sample_ids[i] for i in found.indices[off].tolist())
    worst = float(found.millimetres[off].max())
    summary = (
        f"joints and robot pose of {names(concerned)} are of different moments: up to {significant(worst)} mm and "
        f"{significant(found.degrees[off].max())} deg apart, elsewhere {significant(typical_mm)} mm"
    )
    return Finding(ID, Severity.CRITICAL, summary, _CURE, worst, LIMIT_MM, concerned)


def _by_stamps(case: Examination) -> Finding | None:
    recording = case.recording
    poses, robot, camera = recording.base_T_flange, recording.robot_stamp_s, recording.camera_stamp_s
    if poses is None or robot is None or camera is None:
        return None
    known = np.flatnonzero(np.isfinite(poses).all((1, 2)) & np.isfinite(robot) & np.isfinite(camera))
    if len(known) < 3:
        return None
    lags = camera[known] - robot[known]
    if (lags == lags[0]).all():
        summary = "images and robot poses carry stamps that never differ: whether one is late cannot be seen from them"
        action = "stop the arm for every sample, or stamp images and robot poses where they are read"
        return Finding(ID, Severity.INFO, summary, action)
    lags = np.abs(lags - np.median(lags))
    speed_m, speed_rad = _speeds(poses[known], robot[known])
    moved_mm, moved_deg = 1e3 * speed_m * lags, np.rad2deg(speed_rad * lags)
    off = (lags > LIMIT_LAG_S) & ((moved_mm > LIMIT_MM) | (moved_deg > LIMIT_DEG))
    worst = float(lags.max())
    if not off.any():
        apart = f"{significant(1e3 * worst)} ms apart"
        summary = f"image and robot pose of each sample are at most {apart} beyond the usual"
        return Finding(ID, Severity.OK, summary, value=worst, limit=LIMIT_LAG_S)
    concerned = tuple(recording.sample_ids[i] for i in known[off].tolist())
    summary = (
        f"image and robot pose of {names(concerned)} are up to {significant(1e3 * worst, 3)} ms farther"
        f" apart than usual, in which the arm moves by up to {significant(moved_mm[off].max())} mm and"
        f" {significant(moved_deg[off].max())} deg"
    )
    return Finding(ID, Severity.CRITICAL, summary, _CURE, worst, LIMIT_LAG_S, concerned)


def _speeds(base_T_flange: Array, stamps_s: Array) -> tuple[Array, Array]:
    """Mean speeds (N,) m/s and rad/s to the neighbouring samples, the faster of the two."""
    order = np.argsort(stamps_s, kind="stable")
    poses, seconds = base_T_flange[order], np.maximum(np.diff(stamps_s[order]), 1e-3)
    linear = se3.translation_error_m(poses[:-1], poses[1:]) / seconds
    angular = se3.rotation_error_rad(poses[:-1], poses[1:]) / seconds
    fastest = np.zeros((2, len(order)))
    for row, speeds in zip(fastest, (linear, angular), strict=True):
        row[order] = np.maximum(np.append(speeds, 0.0), np.append(0.0, speeds))
    return fastest[0], fastest[1]
