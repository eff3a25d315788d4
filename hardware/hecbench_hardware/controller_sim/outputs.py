"""The RTDE outputs of the simulated controller, by name. What the simulation has no physics for is constant:
NaN where a value would pretend a measurement (currents, momentum), nominal where it is a setting or a supply.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from math import nan
from typing import Any, Final

import numpy as np

from hecbench_hardware.controller_sim.inputs_outputs import Registers
from hecbench_hardware.controller_sim.program import CYCLE_S, ProgramRunner
from hecbench_hardware.controller_sim.signals import (
    BITS,
    OUTPUTS,
    REGISTERS,
    SAFETY_BITS,
    WIDTHS,
    RobotMode,
    RuntimeState,
)

Reader = Callable[[ProgramRunner], Any]

JOINT_RUNNING, JOINT_POWER_OFF, JOINT_IDLE = 253, 239, 255
SUPPLY_V = 48.0
TEMPERATURE_C = 30.0
_TOOL_RUNNING = 253


def is_playing(program: ProgramRunner) -> bool:
    """Whether a program runs now."""
    return program.runtime is RuntimeState.PLAYING


def speed_scaling(program: ProgramRunner) -> float:
    """The fraction of its speed at which the arm executes the program."""
    return program.arm.slowdown * program.arm.speed_slider if is_playing(program) else 0.0


def joint_mode(program: ProgramRunner) -> int:
    """The mode of every joint."""
    modes = {RobotMode.POWER_OFF: JOINT_POWER_OFF, RobotMode.IDLE: JOINT_IDLE}
    return modes.get(program.arm.robot_mode, JOINT_RUNNING)


def elbow_position(program: ProgramRunner) -> list[float]:
    """Origin of the forearm (3,) in the base frame."""
    elbow: list[float] = program.arm.arm.link_frames(program.arm.joints)[1, :3, 3].tolist()
    return elbow


def elbow_velocity(program: ProgramRunner) -> list[float]:
    """Velocity of the elbow (3,)."""
    frames, speeds = program.arm.arm.link_frames(program.arm.joints), program.arm.joint_speeds
    elbow, shoulder = frames[1, :3, 3], frames[0, :3, 3]
    swing = np.cross([0.0, 0.0, 1.0], elbow) * speeds[0]
    lift = np.cross(frames[0, :3, 2], elbow - shoulder) * speeds[1]
    return [float(x) for x in swing + lift]


def _tcp_acceleration(program: ProgramRunner) -> list[float]:
    arm = program.arm
    if not arm.joint_accelerations.any():
        return [0.0] * 6
    return [float(x) for x in arm.jacobian() @ arm.joint_accelerations]


def _configurable(bits: int) -> int:
    return bits >> 8 & 0xFF


def _analog_types(program: ProgramRunner) -> int:
    io = program.arm.io
    domains = (*io.analog_input_domains[:2], *io.analog_output_domains)
    return sum((domain & 1) << i for i, domain in enumerate(domains))


def _constant(kind: str, value: float) -> Reader:
    constant: float | Sequence[float] = value if WIDTHS[kind] == 1 else [value] * WIDTHS[kind]
    return lambda _: constant


def _registers(direction: str) -> dict[str, Reader]:
    def of(program: ProgramRunner) -> Registers:
        registers: Registers = getattr(program.arm.io, f"{direction}s")
        return registers

    return {
        f"{direction}_bit_registers0_to_31": lambda p: of(p).word(0),
        f"{direction}_bit_registers32_to_63": lambda p: of(p).word(32),
        **{f"{direction}_bit_register_{i}": partial(lambda i, p: of(p).bits[i], i) for i in range(64, BITS)},
        **{f"{direction}_int_register_{i}": partial(lambda i, p: of(p).ints[i], i) for i in range(REGISTERS)},
        **{
            f"{direction}_double_register_{i}": partial(lambda i, p: of(p).doubles[i], i)
            for i in range(REGISTERS)
        },
    }


_NOT_MEASURED: Final = [
    "target_current",
    "actual_current",
    "joint_control_output",
    "wrench_calc_from_currents",
    "actual_momentum",
    "actual_robot_current",
    "actual_tool_accelerometer",
    "actual_robot_energy_consumed",
    "actual_robot_braking_energy_dissipated",
    "target_base_wrench",
]

_SIMULATED: Final[dict[str, Reader]] = {
    "timestamp": lambda p: p.arm.time_s,
    **dict.fromkeys(("target_q", "actual_q"), lambda p: p.arm.joints.tolist()),
    **dict.fromkeys(("target_qd", "actual_qd"), lambda p: p.arm.joint_speeds.tolist()),
    "target_qdd": lambda p: p.arm.joint_accelerations.tolist(),
    **dict.fromkeys(("actual_TCP_pose", "target_TCP_pose"), lambda p: p.arm.tcp_vector),
    **dict.fromkeys(("actual_TCP_speed", "target_TCP_speed"), lambda p: p.arm.tcp_speed),
    **dict.fromkeys(("actual_TCP_acceleration", "target_TCP_acceleration"), _tcp_acceleration),
    **dict.fromkeys(("target_moment", "actual_current_as_torque"), lambda p: p.arm.torques),
    "actual_TCP_force": lambda p: p.arm.wrench.tolist(),
    "ft_raw_wrench": lambda p: p.arm.raw_wrench.tolist(),
    "tcp_force_scalar": lambda p: float(np.linalg.norm(p.arm.wrench[:3])),
    "tcp_offset": lambda p: p.arm.tcp_offset.tolist(),
    "elbow_position": elbow_position,
    "elbow_velocity": elbow_velocity,
    "actual_digital_input_bits": lambda p: p.arm.io.digital_inputs,
    "actual_digital_output_bits": lambda p: p.arm.io.digital_outputs,
    "actual_configurable_digital_input_bits": lambda p: _configurable(p.arm.io.digital_inputs),
    "actual_configurable_digital_output_bits": lambda p: _configurable(p.arm.io.digital_outputs),
    "analog_io_types": _analog_types,
    "standard_analog_input0": lambda p: p.arm.io.analog_inputs[0],
    "standard_analog_input1": lambda p: p.arm.io.analog_inputs[1],
    "standard_analog_output0": lambda p: p.arm.io.analog_outputs[0],
    "standard_analog_output1": lambda p: p.arm.io.analog_outputs[1],
    "tool_analog_input0": lambda p: p.arm.io.analog_inputs[2],
    "tool_analog_input1": lambda p: p.arm.io.analog_inputs[3],
    "tool_output_voltage": lambda p: p.arm.io.tool_voltage,
    "robot_mode": lambda p: p.arm.robot_mode,
    "joint_mode": lambda p: [joint_mode(p)] * 6,
    **dict.fromkeys(("safety_mode", "safety_status"), lambda p: p.arm.safety),
    "speed_scaling": speed_scaling,
    "target_speed_fraction": lambda p: p.arm.speed_slider,
    "runtime_state": lambda p: p.runtime,
    "robot_status_bits": lambda p: (
        int(p.arm.robot_mode >= RobotMode.IDLE) | is_playing(p) << 1 | p.freedrive << 2
    ),
    "safety_status_bits": lambda p: SAFETY_BITS[p.arm.safety],
    "payload": lambda p: p.arm.payload_kg,
    "payload_cog": lambda p: p.arm.payload_cog_m,
    "payload_inertia": lambda p: p.arm.payload_inertia,
    "target_gravity": lambda p: p.arm.gravity,
    "script_control_line": lambda p: p.line,
    "control_step": lambda p: p.cycle,
    **_registers("input"),
    **_registers("output"),
}

_NOMINAL: Final[dict[str, float]] = {
    "joint_temperatures": TEMPERATURE_C,
    "tool_temperature": TEMPERATURE_C,
    "actual_main_voltage": SUPPLY_V,
    "actual_robot_voltage": SUPPLY_V,
    "actual_joint_voltage": SUPPLY_V,
    "actual_execution_time": CYCLE_S,
    "target_execution_time": CYCLE_S,
    "tool_mode": _TOOL_RUNNING,
    **dict.fromkeys(_NOT_MEASURED, nan),
}

READERS: Final[dict[str, Reader]] = {
    name: _SIMULATED.get(name) or _constant(kind, _NOMINAL.get(name, 0)) for name, kind in OUTPUTS.items()
}
"""Every output by name; what is neither simulated nor nominal is absent hardware, and 0."""
