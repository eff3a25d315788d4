"""Target poses that are the mirror image of the true ones: a small flat target has two that look alike.

Collins and Bartoli 2014, "Infinitesimal plane-based pose estimation", section 4: to first order the second
pose has its normal mirrored at the line of sight.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hecbench import se3
from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity, names
from hecbench.se3 import Array
from hecbench.system.wording import significant

ID = "planar_ambiguity"
LEAST_DEG = 8.0
"""Between two poses of a target seen nearly from the front there may be less; those must contradict the others."""
FEW = 0.05
"""Share of mirrored poses that robust methods get over."""
_CLOSER = 0.5


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """Normals of the observed target poses against those that the calibration of all samples predicts."""
    target = case.recording.target
    if case.agreed is None or (target is not None and not target.is_planar):
        return None, case
    predicted, observed = case.agreed[0].camera_T_target, case.camera_T_target
    sight = observed[:, :3, 3] / np.linalg.norm(observed[:, :3, 3], axis=1)[:, None]
    normals = observed[:, :3, 2]
    mirrored = 2 * (normals * sight).sum(1)[:, None] * sight - normals
    gaps = _angles_deg(normals, predicted[:, :3, 2])
    suspected = (gaps > LEAST_DEG) | ~case.agreed[1]
    flipped = suspected & (_angles_deg(mirrored, predicted[:, :3, 2]) < _CLOSER * gaps)
    typical = float(np.rad2deg(np.median(se3.rotation_error_rad(observed, predicted))))
    if not flipped.any():
        summary = f"no target pose is mirrored; their typical rotation error is {significant(typical)} deg"
        return Finding(ID, Severity.OK, summary, value=float(gaps.max()), limit=LEAST_DEG), case
    concerned = case.ids(flipped)
    summary = f"{len(concerned)} target poses are mirrored, by up to {gaps[flipped].max():.0f} deg: {names(concerned)}"
    given = case.recording.camera_T_target is not None
    action = (
        "give corners_px instead of camera_T_target, so that both poses of each image are tried"
        if given
        else "use a larger target or tilt it more; prefer methods that use corners or positions"
    )
    many = flipped.mean() > FEW
    severity = Severity.CRITICAL if given and many else Severity.WARNING
    finding = Finding(ID, severity, summary, action, float(gaps[flipped].max()), LEAST_DEG, concerned)
    if given:  # they bend the calibration of the others
        return finding, replace(case, recording=case.recording.subset(case.usable[~flipped]))
    return finding, replace(case, explained=case.explained | frozenset(concerned))


def _angles_deg(first: Array, second: Array) -> Array:
    sines = np.linalg.norm(np.cross(first, second), axis=1)
    return np.asarray(np.rad2deg(np.arctan2(sines, (first * second).sum(1))))
