"""What the controller knows of itself."""

from __future__ import annotations

from collections.abc import Callable
from math import nan
from typing import Any, Final

import numpy as np

from hecbench.se3 import Array
from hecbench_hardware.controller_sim.outputs import TEMPERATURE_C
from hecbench_hardware.controller_sim.urscript.functions import Builtin, builtins
from hecbench_hardware.controller_sim.urscript.machine import Machine
from hecbench_hardware.controller_sim.urscript.values import Pose, Value, pose, vector

_LOOSE_M, _LOOSE_RAD = 1e-10, 1e-10
_STEP_S = 1e-6


def _tool(m: Machine, tcp: Value) -> Array:
    return m.arm.flange_T_tcp if tcp == "active_tcp" else pose(tcp, "tcp")


def get_inverse_kin(
    m: Machine,
    x: Value,
    qnear: Value = None,
    maxPositionError: Value = _LOOSE_M,
    maxOrientationError: Value = _LOOSE_RAD,
    tcp: Value = "active_tcp",
) -> list[float]:
    """The joints nearest to `qnear` or the present ones; exact, so that the errors allowed do not matter."""
    near = m.arm.joints if qnear is None else vector(qnear, 6, "qnear")
    joints: list[float] = m.arm.solve(pose(x, "x"), near, _tool(m, tcp)).tolist()
    return joints


def get_inverse_kin_has_solution(
    m: Machine,
    pose_: Value,
    qnear: Value = None,
    maxPositionError: Value = _LOOSE_M,
    maxOrientationError: Value = _LOOSE_RAD,
    tcp: Value = "active_tcp",
) -> bool:
    """Whether there are such joints."""
    near = m.arm.joints if qnear is None else vector(qnear, 6, "qnear")
    return m.arm.is_reachable(pose(pose_), near, _tool(m, tcp))


def get_forward_kin(m: Machine, q: Value = None, tcp: Value = "active_tcp") -> Pose:
    """The tool pose of joints."""
    joints = m.arm.joints if q is None else vector(q, 6, "q")
    return Pose.of(m.arm.arm.forward(joints) @ _tool(m, tcp))


def get_actual_joint_positions_history(m: Machine, steps: Value = 0) -> list[float]:
    """The joints some cycles ago."""
    if not 0 <= steps < len(m.arm.history):
        raise ValueError(f"only the last {len(m.arm.history)} cycles are kept")
    joints: list[float] = m.arm.history[-1 - int(steps)].tolist()
    return joints


def get_target_waypoint(m: Machine) -> Pose:
    """Where the present or last motion goes."""
    return Pose(m.arm.tcp_vector) if m.waypoint is None else Pose(m.waypoint.tolist())


def is_within_safety_limits(m: Machine, pose_: Value, qnear: Value = None) -> bool:
    """Whether a pose or joints are in reach; there are no other safety limits here."""
    if isinstance(pose_, Pose):
        return m.arm.is_reachable(pose_.matrix, m.arm.joints if qnear is None else vector(qnear, 6, "qnear"))
    return bool(np.abs(vector(pose_, 6, "the joints")).max() <= m.arm.arm.joint_range_rad)


def tool_contact(m: Machine, direction: Value = None) -> int:
    """1 while a force against the direction, of any direction without one, is felt; 0 otherwise."""
    return int(m.arm.feels_contact([0.0] * 3 if direction is None else vector(direction, 6, "direction")[:3]))


def get_joint_temp(_: Machine, j: Value) -> float:
    """Nominal, of joints 0 to 5."""
    if j not in range(6):
        raise ValueError(f"there is no joint {j}: joints are 0 to 5")
    return TEMPERATURE_C


def get_jacobian(m: Machine, q: Value = None, tcp: Value = "active_tcp") -> list[list[float]]:
    """The geometric Jacobian of a tool, the present one by default."""
    joints = None if q is None else vector(q, 6, "q")
    rows: list[list[float]] = m.arm.jacobian(joints, _tool(m, tcp)).tolist()
    return rows


def get_jacobian_time_derivative(m: Machine) -> list[list[float]]:
    """Its rate of change."""
    arm = m.arm
    later = arm.jacobian(arm.joints + arm.joint_speeds * _STEP_S)
    rows: list[list[float]] = ((later - arm.jacobian()) / _STEP_S).tolist()
    return rows


def _reading(name: str, read: Callable[[Machine], Any]) -> Builtin:
    return Builtin(name, read, ())


def _pose_of_flange(m: Machine) -> Pose:
    return Pose.of(m.arm.arm.forward(m.arm.joints))


_READINGS: Final[dict[str, Callable[[Machine], Any]]] = {
    **dict.fromkeys(
        ("get_actual_joint_positions", "get_target_joint_positions", "get_joint_positions"),
        lambda m: m.arm.joints.tolist(),
    ),
    **dict.fromkeys(
        ("get_actual_joint_speeds", "get_target_joint_speeds"), lambda m: m.arm.joint_speeds.tolist()
    ),
    "get_target_joint_accelerations": lambda m: m.arm.joint_accelerations.tolist(),
    **dict.fromkeys(("get_actual_tcp_pose", "get_target_tcp_pose"), lambda m: Pose(m.arm.tcp_vector)),
    **dict.fromkeys(("get_actual_tcp_speed", "get_target_tcp_speed"), lambda m: list(m.arm.tcp_speed)),
    **dict.fromkeys(("get_actual_tool_flange_pose", "get_target_tool_flange_pose"), _pose_of_flange),
    "get_tcp_force": lambda m: m.arm.wrench.tolist(),
    "force": lambda m: float(np.linalg.norm(m.arm.wrench[:3])),
    "get_tcp_offset": lambda m: Pose(m.arm.tcp_offset.tolist()),
    "get_joint_torques": lambda m: list(m.arm.torques),
    "get_coriolis_and_centrifugal_torques": lambda m: m.arm.dynamics.coriolis(
        m.arm.joints, m.arm.joint_speeds
    ).tolist(),
    "get_mass_matrix": lambda m: m.arm.dynamics.mass_matrix(m.arm.joints).tolist(),
    "get_tool_accelerometer_reading": lambda _: [nan] * 3,
    "get_tool_current": lambda _: nan,
    "get_controller_temp": lambda _: TEMPERATURE_C,
    "get_steptime": lambda m: m.arm.dt_s,
    "get_target_payload": lambda m: m.arm.payload_kg,
    "get_target_payload_cog": lambda m: list(m.arm.payload_cog_m),
    "get_target_payload_inertia": lambda m: list(m.arm.payload_inertia),
    "get_gravity": lambda m: list(m.arm.gravity),
    "get_freedrive_status": lambda m: 0 if m.runner.freedrive else -1,
    "is_steady": lambda m: m.arm.is_steady(),
}

FUNCTIONS: Final = {
    **{name: _reading(name, read) for name, read in _READINGS.items()},
    **builtins(
        get_inverse_kin,
        get_inverse_kin_has_solution,
        get_forward_kin,
        get_actual_joint_positions_history,
        get_target_waypoint,
        is_within_safety_limits,
        tool_contact,
        get_joint_temp,
        get_jacobian,
        get_jacobian_time_derivative,
    ),
}
