"""All findings on a recording, in the order in which causes hide each other.

Every file of a finding has `examine(case)`, which returns its finding and the case for the next ones: cured, where
the fault has one obvious cure, so that one fault is named once instead of by all that suffer from it.
"""

from __future__ import annotations

from collections.abc import Callable

from hecbench.diagnose import (
    camera_frame,
    clock_lag,
    conditioning,
    consistency,
    coverage,
    depth,
    image_quality,
    influence,
    intrinsics,
    joints_vs_pose,
    next_pose,
    outlier_sample,
    pairing,
    picture_residual,
    planar_ambiguity,
    pose_direction_or_mounting,
    repeats,
    robot_model,
    rotation_diversity,
    rotation_reading,
    sample_moving,
    target_scale,
    units,
)
from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity
from hecbench.recording import Recording

_STEPS: tuple[Callable[[Examination], tuple[Finding | None, Examination]], ...] = (
    image_quality.examine,
    depth.examine,
    repeats.examine,
    camera_frame.examine,
    picture_residual.examine,
    robot_model.examine,
    joints_vs_pose.examine,
    sample_moving.examine,
    rotation_diversity.examine,
    pose_direction_or_mounting.examine,
    units.examine,
    rotation_reading.examine,
    clock_lag.examine,
    pairing.examine,
    intrinsics.examine,
    consistency.examine,
    target_scale.examine,
    planar_ambiguity.examine,
    outlier_sample.examine,
    coverage.examine,
    conditioning.examine,
    influence.examine,
    next_pose.examine,
)


def check(recording: Recording, prepared: Recording | None = None) -> list[Finding]:
    """Every finding that applies to this recording, in the order in which the causes hide each other.

    Args:
        recording: as it was read.
        prepared: what `preparation.prepare` made of it, so that nothing is detected twice.
    """
    case, findings = Examination.of(recording, prepared), []
    for examine in _STEPS:
        finding, case = examine(case)
        if finding is not None:
            findings.append(finding)
    faulty = {finding.id for finding in findings if finding.severity is not Severity.OK}
    return [
        finding for finding in findings if finding.severity is not Severity.OK or finding.id not in faulty
    ]
