"""Robot poses that are not the forward kinematics of the joints: another flange or base frame, or another arm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.diagnose.calibrate import spread
from hecbench.diagnose.case import Examination, inverted
from hecbench.diagnose.finding import Finding, Severity
from hecbench.se3 import Array
from hecbench.system.wording import significant

ID = "joints_vs_pose"
LIMIT_MM = 3.0
LIMIT_DEG = 0.5
_LEAST_SAMPLES = 3
_LEVER_M = 0.2
"""A rotation counts like the motion of a point this far away, when readings are compared."""


@dataclass(frozen=True, eq=False)
class Agreement:
    """Robot poses against forward kinematics, up to one constant frame.

    Attributes:
        kind: `same`, `tool` (a constant frame after the flange) or `base` (before the base).
        constant: that frame (4, 4).
        indices: the samples (M,) that have both.
        degrees, millimetres: what is left per sample (M,).
    """

    kind: str
    constant: Array
    indices: NDArray[np.int64]
    degrees: Array
    millimetres: Array

    @property
    def typical(self) -> tuple[float, float]:
        """Medians, deg and mm."""
        return float(np.median(self.degrees)), float(np.median(self.millimetres))

    @property
    def holds(self) -> bool:
        """Whether most samples agree."""
        degrees, millimetres = self.typical
        return degrees <= LIMIT_DEG and millimetres <= LIMIT_MM


def agreement(case: Examination) -> Agreement | None:
    """The simplest reading under which poses and joints agree, or the best of those that do not."""
    by_joints, given = case.base_T_flange_by_joints, case.recording.base_T_flange
    if by_joints is None or given is None:
        return None
    indices = np.flatnonzero(np.isfinite(by_joints).all((1, 2)) & np.isfinite(given).all((1, 2)))
    if len(indices) < _LEAST_SAMPLES:
        return None
    readings = [_compare(by_joints[indices], poses[indices], indices) for poses in (given, inverted(given))]
    as_given, turned = (min(found, key=_badness) for found in readings)
    if turned.holds and not as_given.holds:
        return turned
    return next((reading for reading in readings[0] if reading.holds), as_given)


def _badness(reading: Agreement) -> float:
    degrees, millimetres = reading.typical
    return millimetres + 1e3 * _LEVER_M * float(np.deg2rad(degrees))


def _compare(by_joints: Array, given: Array, indices: NDArray[np.int64]) -> list[Agreement]:
    tools, bases = se3.inverse(by_joints) @ given, given @ se3.inverse(by_joints)
    found = []
    for kind, changes in (("same", tools), ("tool", tools), ("base", bases)):
        constant = np.eye(4) if kind == "same" else _most_agreed(changes)
        degrees = np.rad2deg(se3.rotation_error_rad(constant, changes))
        found.append(
            Agreement(kind, constant, indices, degrees, 1e3 * se3.translation_error_m(constant, changes))
        )
    return found


def _most_agreed(poses: Array) -> Array:
    """The one of poses (M, 4, 4) that most others are near."""
    candidates = poses[spread(len(poses))]
    apart = se3.translation_error_m(candidates[:, None], poses)
    apart = apart + _LEVER_M * se3.rotation_error_rad(candidates[:, None], poses)
    return np.asarray(candidates[np.median(apart, axis=1).argmin()])


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """The constant frame between poses and joints, and what is left beyond it."""
    found = agreement(case)
    if found is None:
        return None, case
    degrees, millimetres = found.typical
    left = f"{significant(millimetres)} mm and {significant(degrees)} deg"
    if not found.holds:
        summary = f"robot poses and forward kinematics of the joints differ by {left} in the typical sample"
        action = "check robot.model, base_link, flange_link and the order and unit (rad) of the joints"
        return Finding(ID, Severity.WARNING, summary, action, millimetres, LIMIT_MM), case
    if found.kind == "same":
        summary = f"robot poses are the forward kinematics of the joints to {left}"
        return Finding(ID, Severity.OK, summary, value=millimetres, limit=LIMIT_MM), case
    offset_mm = 1e3 * float(np.linalg.norm(found.constant[:3, 3]))
    offset_deg = float(np.rad2deg(se3.rotation_angle(found.constant[:3, :3])))
    offset = f"by a constant {significant(offset_mm, 4)} mm and {significant(offset_deg, 4)} deg"
    if found.kind == "tool":
        summary = f"robot poses end {offset} away from the flange that the joints give"
        action = (
            "write poses of the flange, not of the tool centre point, or name that frame in robot.flange_link"
        )
    else:
        summary = f"robot poses start {offset} away from the base that the joints give"
        action = "name the frame in robot.base_link: a UR's `base` is `base_link` turned by 180 deg about z"
    return Finding(ID, Severity.WARNING, summary, action, offset_mm, LIMIT_MM), case
