"""Target poses in a frame that is not a camera's optical one: x forward (camera_link), z backward, a tracker's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity
from hecbench.system.wording import significant

ID = "camera_frame"


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """Where the targets lie; they are examined as a camera would see them that looks at them."""
    poses, optical_T_camera = case.observed.camera_T_target, case.optical_T_camera
    if poses is not None and not np.nan_to_num(poses[:, :3, 3]).any():
        summary = "camera_T_target holds rotations only: its translations are all zero"
        finding = Finding(ID, Severity.CRITICAL, summary, "write the target's position too, in metres")
        return finding, replace(case, judged=False)
    if poses is None or np.array_equal(optical_T_camera, np.eye(4)):
        return None, case
    towards = optical_T_camera[2, :3]
    axis = int(np.abs(towards).argmax())
    along = f"{'-' if towards[axis] < 0 else '+'}{'xyz'[axis]}"
    known = poses[np.isfinite(poses).all((1, 2))]
    typical = np.median(known[:, :3, 3], axis=0)
    around = optical_T_camera[2, 3] > 0
    where = "around its origin, as trackers see them" if around else f"along its {along} axis, not along +z"
    summary = (
        f"camera_T_target is not in an optical frame (z forward, x right): the targets lie {where}; the typical one at "
        f"({', '.join(significant(value) for value in typical)}) m"
    )
    action = "the answer is for this frame (camera_link, a tracker ...); photographs need the optical frame"
    return Finding(ID, Severity.INFO, summary, action), case
