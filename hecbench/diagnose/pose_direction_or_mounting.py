"""Robot poses written in the other direction, or the other mounting declared: the same numbers either way.

A camera on the flange with base_T_flange, and a camera beside the robot with flange_T_base, give the same hand
poses: only joints, through forward kinematics, tell which of the two was meant.
"""

from __future__ import annotations

import numpy as np

from hecbench import se3
from hecbench.diagnose.case import Examination, inverted, other
from hecbench.diagnose.finding import Finding, Severity
from hecbench.diagnose.fit import MUCH_BETTER
from hecbench.system.wording import significant

ID = "pose_direction_or_mounting"
_AGREES_DEG = 10.0


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """Residuals of the declared reading against those of the inverted poses."""
    if not case.can_be_fitted or case.observed.base_T_flange is None:
        return None, case
    turned = case.with_robot_poses(inverted(case.observed.base_T_flange))
    as_declared = np.inf if case.fit is None else case.fit.typical_px
    if turned.fit is None or not turned.fit.cures(case.fit):
        if case.fit is None:
            return None, case
        summary = f"as declared the typical sample fits to {significant(as_declared)} px"
        if turned.fit is not None:
            summary += f", with inverted robot poses to {significant(turned.fit.typical_px, 3)} px"
        return Finding(ID, Severity.OK, summary, value=as_declared), case
    better = turned.fit.typical_px
    before = "not at all" if case.fit is None else f"to {significant(as_declared, 3)} px"
    cause, action = _cause_and_cure(case)
    summary = (
        f"{cause}: as declared the typical sample fits {before}, the other way to {significant(better)} px"
    )
    limit = None if case.fit is None else MUCH_BETTER * as_declared
    return Finding(ID, Severity.CRITICAL, summary, action, better, limit), turned


def _cause_and_cure(case: Examination) -> tuple[str, str]:
    mounting = case.recording.mounting
    invert = "write base_T_flange, which maps flange coordinates to the base, instead of its inverse"
    remount = f"declare mounting '{other(mounting)}' instead of '{mounting}'"
    by_joints, given = case.base_T_flange_by_joints, case.recording.base_T_flange
    if given is None:
        return "the mounting looks wrong", remount
    if by_joints is not None:
        if _agree(by_joints, given):
            return "the mounting is wrong, the joints confirm the robot poses", remount
        if _agree(by_joints, inverted(given)):
            return "the robot poses are inverted, as the joints prove", invert
    return "the robot poses look inverted, or the mounting is wrong", f"{invert}; or {remount}"


def _agree(first: np.ndarray, second: np.ndarray) -> bool:
    """Whether poses (samples, 4, 4) are the same up to a constant tool and a constant base frame.

    Compared by the angles of the motions seen from the tool, which neither changes.
    """
    both = np.isfinite(first).all((1, 2)) & np.isfinite(second).all((1, 2))
    if both.sum() < 3:
        return False
    relative = [se3.inverse(poses[both][:-1]) @ poses[both][1:] for poses in (first, second)]
    logs = [se3.so3_log(motions[:, :3, :3]) for motions in relative]
    rotation = se3.nearest_rotation(logs[0].T @ logs[1])
    gaps = np.linalg.norm(logs[0] - logs[1] @ rotation.T, axis=1)
    return bool(np.rad2deg(np.median(gaps)) < _AGREES_DEG)
