"""How many samples there are, and how well their targets fill the view in three dimensions."""

from __future__ import annotations

import numpy as np

from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity
from hecbench.system.wording import significant
from hecbench.targets import Target

ID = "coverage"
FEW_SAMPLES = 8
_LEAST_POINTS = 4
"""Of a target whose pose can be computed from its corners."""
FLAT = 0.05
"""Smallest over largest extent of the target positions below which they count as coplanar."""
NARROW = 0.03
"""Of the distance: positions closer together than that are seen under nearly the same angle."""


def _has_a_pose(target: Target | None) -> bool:
    """Whether a pose can be seen of it; fewer points are labels on the robot, which only measure."""
    return target is None or len(target.points_m) >= _LEAST_POINTS


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """Sample count, and the principal extents of the target positions in the camera frame."""
    if case.agreed is None:
        if case.recording.target is None and case.observed.camera_T_target is None:
            return None, case
        summary = f"{len(case.usable)} samples have a robot pose and a target pose"
        severity = Severity.INFO if len(case.usable) >= FEW_SAMPLES else Severity.WARNING
        if not len(case.usable) and _has_a_pose(case.recording.target):
            summary = "no sample has a robot pose and a target pose: there is nothing to examine"
            summary = "; ".join([summary, *case.said])
            severity = Severity.CRITICAL
        action = "" if severity is Severity.INFO else "record 10 or more samples that show the target"
        return Finding(ID, severity, summary, action, float(len(case.usable)), float(FEW_SAMPLES)), case
    positions = case.agreed[0].camera_T_target[:, :3, 3]
    extents_m = np.linalg.svd(positions - positions.mean(0), compute_uv=False) / np.sqrt(len(positions))
    flatness = float(extents_m[2] / extents_m[0])
    distance_m = float(np.median(positions[:, 2]))
    size = " x ".join(f"{1e3 * extent:.0f}" for extent in extents_m)
    samples = f"{len(positions)} samples"
    if case.pictures > len(case.recording):
        samples = f"{case.pictures} samples at {len(positions)} robot poses, which count once each"
    summary = f"{samples}, target positions spread by {size} mm rms at {significant(distance_m)} m"
    if len(positions) < FEW_SAMPLES:
        action = "record samples at 10 or more robot poses"
        return Finding(ID, Severity.WARNING, summary, action, float(len(positions)), float(FEW_SAMPLES)), case
    if flatness < FLAT:
        summary += ": they lie in a plane"
        action = "move the target out of that plane too; `single3d_closed` is useless on these positions"
        return Finding(ID, Severity.WARNING, summary, action, flatness, FLAT), case
    if extents_m[0] < NARROW * distance_m:
        action = "move the target through more of the camera's view, and nearer and farther"
        return Finding(ID, Severity.WARNING, summary, action, float(extents_m[0] / distance_m), NARROW), case
    return Finding(ID, Severity.OK, summary, value=flatness, limit=FLAT), case
