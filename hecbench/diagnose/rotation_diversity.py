"""Whether the hand turned enough, and about two axes: without that the translation is unobservable.

Tsai and Lenz 1989, section III: with one axis the translation along it is undetermined, and the error of all
methods grows as the rotation shrinks.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hecbench import se3
from hecbench.diagnose.calibrate import spread
from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity
from hecbench.se3 import Array
from hecbench.system.wording import significant

ID = "rotation_diversity"
LEAST_ANGLE_DEG = 10.0
LEAST_SECOND_AXIS_DEG = 2.0
GOOD_SECOND_AXIS_DEG = 5.0
_TILT = "tilt the hand by 20 to 40 deg about two different axes between samples"


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """The largest rotation between two samples, and the rms rotation about the second principal axis."""
    poses = case.observed.base_T_flange
    sees_target = case.recording.target is not None or case.observed.camera_T_target is not None
    if poses is None or not sees_target:  # methods that look at the robot itself need no such motion
        return None, case
    rotations = poses[np.isfinite(poses).all((1, 2)), :3, :3]
    if len(rotations) < 3:
        summary = f"only {len(rotations)} samples have a robot pose"
        finding = Finding(
            ID, Severity.CRITICAL, summary, "record 10 or more samples", float(len(rotations)), 3.0
        )
        return finding, replace(case, judged=False)
    largest, second = turns_deg(rotations)
    if largest < LEAST_ANGLE_DEG:
        summary = f"the hand turns by {significant(largest)} deg at most between samples"
        finding = Finding(ID, Severity.CRITICAL, summary, _TILT, largest, LEAST_ANGLE_DEG)
        return finding, replace(case, judged=False)
    summary = (
        f"the hand turns by up to {largest:.0f} deg, by {significant(second)} deg rms about its second axis"
    )
    if second < LEAST_SECOND_AXIS_DEG:
        summary = f"the hand turns about one axis only: {significant(second)} deg rms about any other"
        finding = Finding(ID, Severity.CRITICAL, summary, _TILT, second, LEAST_SECOND_AXIS_DEG)
        return finding, replace(case, judged=False)
    if second < GOOD_SECOND_AXIS_DEG:
        return Finding(ID, Severity.WARNING, summary, _TILT, second, GOOD_SECOND_AXIS_DEG), case
    return Finding(ID, Severity.OK, summary, value=second, limit=GOOD_SECOND_AXIS_DEG), case


def turns_deg(rotations: Array) -> tuple[float, float]:
    """The largest rotation between two of (N, 3, 3), N > 1, and the rms rotation about the second principal axis."""
    chosen = rotations[spread(len(rotations))]
    i, j = np.triu_indices(len(chosen), 1)
    logs = se3.so3_log(np.swapaxes(chosen[i], 1, 2) @ chosen[j])
    largest = float(np.rad2deg(np.linalg.norm(logs, axis=1).max()))
    singular = np.linalg.svd(logs, compute_uv=False)
    second = float(np.rad2deg(singular[1]) / np.sqrt(len(logs))) if len(singular) > 1 else 0.0
    return largest, second
