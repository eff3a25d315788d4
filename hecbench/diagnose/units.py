"""Millimetres read as metres: robot poses of hundreds of metres, or a target a thousand times too large or small."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity
from hecbench.system.wording import significant

ID = "units"
REACH_M = 10.0
"""No arm reaches farther."""
LARGEST_TARGET_M = 5.0
_FACTORS = {1000.0: "mm", 100.0: "cm", 39.37: "inch"}
_NEAR = 1.3


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """The reach of the robot poses, and the target's motion against the robot's."""
    poses, target = case.observed.base_T_flange, case.recording.target
    if poses is None:
        return None, case
    reach_m = float(np.nanmax(np.abs(poses[:, :3, 3])))
    unit = _unit(case.fit.state.scale) if case.fit else None
    if reach_m > REACH_M:
        factor, name = unit if unit and unit[0] > 1 else (1000.0, "mm")
        reach = f"the flange is up to {significant(reach_m, 4)} m from the base"
        summary = f"{reach}: its positions are in {name}, not in metres"
        action = f"divide the translations of base_T_flange by {factor:g}"
        return _critical(summary, action, reach_m, REACH_M), _rescaled_robot(case, factor)
    size_m = 0.0 if target is None else float(np.ptp(target.points_m, axis=0).max())
    if size_m > LARGEST_TARGET_M or (unit and unit[0] < 1):
        factor, name = (1 / unit[0], unit[1]) if unit and unit[0] < 1 else (1000.0, "mm")
        motion = (
            f"it seems to move {significant(factor, 3)} times as far as the robot carries it" if unit else ""
        )
        what = f"the target of {significant(size_m, 4)} m is given in {name}, not in metres"
        if target is None:
            what = f"camera_T_target is in {name}, not in metres"
        summary = f"{what}: {motion}" if motion else what
        action = f"divide the size of the target, or the translations of camera_T_target, by {factor:g}"
        return _critical(summary, action, size_m or factor, LARGEST_TARGET_M), _resized_target(
            case, 1 / factor
        )
    if unit:
        times = f"the robot moves {significant(unit[0], 3)} times as far as the target"
        summary = f"{times}: one of the two is not in metres"
        action = (
            f"give the target's size in metres (it looks {unit[0]:g} times too small), or the robot poses"
        )
        return _critical(summary, action, unit[0], _NEAR), _resized_target(case, unit[0])
    return Finding(
        ID, Severity.OK, f"the flange stays within {significant(reach_m)} m", value=reach_m, limit=REACH_M
    ), case


def _critical(summary: str, action: str, value: float, limit: float) -> Finding:
    return Finding(ID, Severity.CRITICAL, summary, action, value, limit)


def _unit(scale: float) -> tuple[float, str] | None:
    """The conversion factor that the robot's motion over the target's comes near to, and the unit's name."""
    for factor, name in _FACTORS.items():
        for candidate in (factor, 1 / factor):
            if 1 / _NEAR < scale / candidate < _NEAR:
                return candidate, name
    return None


def _rescaled_robot(case: Examination, factor: float) -> Examination:
    """The case with robot translations divided."""
    poses = case.observed.present.base_T_flange
    poses = poses.copy()
    poses[:, :3, 3] /= factor
    return case.with_robot_poses(poses)


def _resized_target(case: Examination, factor: float) -> Examination:
    """The case with the target's size multiplied."""
    return replace(case, size_factor=case.size_factor * factor)
