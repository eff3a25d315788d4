"""The state message of the primary and secondary interfaces (maker's "Client interfaces", software 3.4 to 5.10)."""

from __future__ import annotations

import struct
from math import nan, pi

from hecbench_hardware.controller_sim.arm import MAX_JOINT_SPEED_RAD_S
from hecbench_hardware.controller_sim.outputs import SUPPLY_V, TEMPERATURE_C, joint_mode, speed_scaling
from hecbench_hardware.controller_sim.program import ProgramRunner
from hecbench_hardware.controller_sim.signals import RobotMode, RuntimeState, SafetyMode

_ROBOT_STATE = 16
_MODE, _JOINTS, _TOOL, _MASTERBOARD, _CARTESIAN, _KINEMATICS = 0, 1, 2, 3, 4, 5
_CONFIGURATION, _FORCE, _ADDITIONAL, _TOOL_LINE, _TOOL_MODE, _SINGULARITY = 6, 7, 8, 11, 12, 13
_TOOL_RUNNING = 253
_POSITION_CONTROL, _TEACH_CONTROL, _FORCE_CONTROL = 0, 1, 2
_MAX_ACCELERATION_RAD_S2 = 40.0
_DEFAULTS = (1.05, 1.4, 0.25, 1.2, 1.0)
"""Default speed and acceleration of joints and of the tool, and the radius that compares them."""
_CABINET, _MASTERBOARD_VERSION = 3, 5
_ROBOT_TYPES = {"ur3e": 3, "ur5e": 1, "ur10e": 2}
_TWISTS = (pi / 2, 0.0, 0.0, pi / 2, -pi / 2, 0.0)
_BAUD = 115200
_RESERVED_BYTE, _E_SERIES = (3, 5), (5,)
"""From which version on the mode ends with a reserved byte, and the tool flange has packages of its own."""

Version = tuple[int, ...]


def robot_state(program: ProgramRunner, version: Version) -> bytes:
    """The message of this cycle, as this version of the software lays it out."""
    parts = [
        _part(_MODE, _mode(program)[: None if version >= _RESERVED_BYTE else -1]),
        _part(_JOINTS, _joints(program)),
        _part(_TOOL, _tool(program)),
        _part(_MASTERBOARD, _masterboard(program)),
        _part(_CARTESIAN, struct.pack(">12d", *program.arm.tcp_vector, *program.arm.tcp_offset)),
        _part(_KINEMATICS, struct.pack(">6I24dI", *[0] * 6, *_kinematics(program, theta_first=True), 0)),
        _part(_CONFIGURATION, _configuration(program)),
        _part(_FORCE, struct.pack(">7d", *program.arm.wrench, nan)),
        _part(_ADDITIONAL, struct.pack(">BB?B", program.freedrive, True, False, 0)),
    ]
    if version >= _E_SERIES:
        parts += _tool_flange()
    body = b"".join(parts)
    return struct.pack(">iB", 5 + len(body), _ROBOT_STATE) + body


def _tool_flange() -> list[bytes]:
    return [
        _part(_TOOL_LINE, struct.pack(">?iiiff", False, _BAUD, 0, 1, 1.5, 3.5)),
        _part(_TOOL_MODE, bytes(3)),
        _part(_SINGULARITY, bytes(2)),
    ]


def _part(kind: int, body: bytes) -> bytes:
    return struct.pack(">iB", 5 + len(body), kind) + body


def _mode(program: ProgramRunner) -> bytes:
    arm = program.arm
    control = _FORCE_CONTROL if program.force else _TEACH_CONTROL if program.freedrive else _POSITION_CONTROL
    return struct.pack(
        ">Q7?BBdddB",
        int(arm.time_s * 1e6),
        *(True, True, arm.robot_mode is not RobotMode.POWER_OFF),
        *(arm.safety is SafetyMode.ROBOT_EMERGENCY_STOP, arm.safety is SafetyMode.PROTECTIVE_STOP),
        *(program.runtime is RuntimeState.PLAYING, program.runtime is RuntimeState.PAUSED),
        *(arm.robot_mode, control, arm.speed_slider, speed_scaling(program), 1.0, 0),
    )


def _joints(program: ProgramRunner) -> bytes:
    arm, mode = program.arm, joint_mode(program)
    return b"".join(
        struct.pack(">dddffffB", q, q, qd, nan, SUPPLY_V, TEMPERATURE_C, 0.0, mode)
        for q, qd in zip(arm.joints, arm.joint_speeds, strict=True)
    )


def _tool(program: ProgramRunner) -> bytes:
    io = program.arm.io
    domains, values = io.analog_input_domains[2:], io.analog_inputs[2:]
    return struct.pack(
        ">BBddfBffB", *domains, *values, SUPPLY_V, io.tool_voltage, nan, TEMPERATURE_C, _TOOL_RUNNING
    )


def _masterboard(program: ProgramRunner) -> bytes:
    io = program.arm.io
    return struct.pack(
        ">iiBBddBBddffffBBBIBBB",
        *(io.digital_inputs, io.digital_outputs, *io.analog_input_domains[:2], *io.analog_inputs[:2]),
        *(*io.analog_output_domains, *io.analog_outputs, TEMPERATURE_C, SUPPLY_V, nan, nan),
        *(program.arm.safety, 0, 0, 0, 0, 0, 0),
    )


def _kinematics(program: ProgramRunner, *, theta_first: bool) -> tuple[float, ...]:
    """The nominal Denavit-Hartenberg parameters, six each of theta, a, d, alpha (or theta last)."""
    arm = program.arm.arm
    lengths = (0.0, *arm.a_m, 0.0, 0.0, 0.0)
    offsets = (arm.d_m[0], 0.0, 0.0, *arm.d_m[1:])
    rest = (*lengths, *offsets, *_TWISTS)
    return (*[0.0] * 6, *rest) if theta_first else (*rest, *[0.0] * 6)


def _configuration(program: ProgramRunner) -> bytes:
    limit = program.arm.arm.joint_range_rad
    return struct.pack(
        ">12d12d5d24d4i",
        *[-limit, limit] * 6,
        *[MAX_JOINT_SPEED_RAD_S, _MAX_ACCELERATION_RAD_S2] * 6,
        *_DEFAULTS,
        *_kinematics(program, theta_first=False),
        *(_MASTERBOARD_VERSION, _CABINET, _ROBOT_TYPES[program.arm.arm.name], 1),
    )
