"""A plan is a recording whose samples have joints: an old recording can be driven again, pose by pose."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path

import msgspec
import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import Recording
from hecbench.se3 import Array
from hecbench.system import files
from hecbench_hardware.clearance import check_motion
from hecbench_hardware.kinematics import Arm
from hecbench_hardware.limits import Limits
from hecbench_hardware.motions import JointMotion, motion_time_s

_TIME_SCALE = 50.0
_PATIENCE_S = 5.0


@dataclass(frozen=True)
class PlannedPose:
    """One motion of a checked plan."""

    id: str
    joints_rad: list[float]
    base_T_flange: list[list[float]]
    expected_s: float
    reached_error_rad: float | None = None
    """Largest joint error after the motion on the simulated controller; None before it was driven."""


def planned_joints(plan: Recording) -> Array:
    """The joints (N, 6) rad of a plan; refuses a recording without them."""
    joints = plan.joints_rad
    if joints is None or joints.shape[1] != 6 or not np.isfinite(joints).all():
        raise InputError(
            f"{plan.name}: every sample of a plan needs six joints_rad; generate poses, or freedrive"
        )
    return joints


def check_plan(arm: Arm, plan: Recording, start: Array, limits: Limits) -> list[PlannedPose]:
    """Check every motion of a plan from joints `start` (6,) rad on; nothing moves.

    Raises:
        InputError: The first sample whose target or path leaves the limits.
    """
    steps, here = [], start
    for sample_id, there in zip(plan.sample_ids, planned_joints(plan), strict=True):
        try:
            check_motion(arm, JointMotion(arm, here, there), limits)
        except InputError as error:
            raise InputError(f"{plan.name}: sample {sample_id}: {error}") from None
        length = float(np.abs(there - here).max())
        expected_s = motion_time_s(length, limits.joint_speed_rad_s, limits.joint_acceleration_rad_s2)
        steps.append(PlannedPose(sample_id, there.tolist(), arm.forward(there).tolist(), expected_s))
        here = there
    return steps


def dry_run(arm: Arm, plan: Recording, start: Array, limits: Limits) -> list[PlannedPose]:
    """Check a plan and drive it on a simulated controller of its own; nothing else gets a byte.

    Raises:
        InputError: The plan leaves the limits.
        DeviceFault: The simulated controller stopped.
    """
    from hecbench_hardware.controller_sim.process import SimulatedController
    from hecbench_hardware.ur.robot import UrRobot
    from hecbench_hardware.ur.stream import Supervision

    steps, driven = check_plan(arm, plan, start, limits), []
    with SimulatedController(model=arm.name, time_scale=_TIME_SCALE) as controller:
        controller.fault("place " + " ".join(map(str, start.tolist())))
        patient = Supervision(max_age_s=_PATIENCE_S, late_s=_PATIENCE_S, leniency=_PATIENCE_S)
        with UrRobot(controller.host, arm, limits=limits, supervision=patient) as robot:
            robot.enable()
            for step in steps:
                robot.move_joints(np.array(step.joints_rad))
                error_rad = float(np.abs(robot.settle().joints_rad - step.joints_rad).max())
                driven.append(replace(step, reached_error_rad=error_rad))
    return driven


def write_plan(steps: list[PlannedPose], path: Path) -> None:
    """Write the checked plan as JSON: what would be sent, in order, with its time and tool positions."""
    positions = np.array([step.base_T_flange for step in steps])
    content = {
        "motions": len(steps),
        "expected_s": sum(step.expected_s for step in steps),
        "flange_lower_m": positions[:, :3, 3].min(0).tolist(),
        "flange_upper_m": positions[:, :3, 3].max(0).tolist(),
        "largest_rotation_deg": float(np.degrees(_largest_rotation(positions))),
        "steps": [asdict(step) for step in steps],
    }
    files.write_bytes(path, msgspec.json.format(msgspec.json.encode(content), indent=1) + b"\n")


def _largest_rotation(base_T_flange: Array) -> float:
    return float(max(se3.rotation_error_rad(base_T_flange, pose).max() for pose in base_T_flange))
