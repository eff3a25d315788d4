"""The frame of the real-time interface (maker's "Real-time 5.10"): its length, then doubles."""

from __future__ import annotations

import struct
from math import nan

from hecbench_hardware.controller_sim.outputs import (
    SUPPLY_V,
    TEMPERATURE_C,
    elbow_position,
    elbow_velocity,
    joint_mode,
    speed_scaling,
)
from hecbench_hardware.controller_sim.program import CYCLE_S, ProgramRunner

_DOUBLES = (
    ((5, 10), 152),
    ((5, 4), 139),
    ((5, 0), 138),
    ((3, 15), 152),
    ((3, 10), 139),
    ((3, 5), 138),
    ((3, 2), 132),
)
"""How many numbers a frame has from each version on, the newest series first; each adds some at the end."""
_OLDEST_DOUBLES = 130
_UNKNOWN = [nan] * 6
"""Currents."""


def realtime_state(program: ProgramRunner, version: tuple[int, ...]) -> bytes:
    """The state of this cycle, as long as it is with this version of the software."""
    count = next((count for since, count in _DOUBLES if version >= since), _OLDEST_DOUBLES)
    return struct.pack(f">i{count}d", 4 + 8 * count, *_numbers(program)[:count])


def _numbers(program: ProgramRunner) -> tuple[float, ...]:
    arm = program.arm
    joints, speeds = arm.joints.tolist(), arm.joint_speeds.tolist()
    pose, twist = arm.tcp_vector, arm.tcp_speed
    return (
        *(arm.time_s, *joints, *speeds, *arm.joint_accelerations.tolist(), *_UNKNOWN, *arm.torques),
        *(*joints, *speeds, *_UNKNOWN, *_UNKNOWN, *pose, *twist, *arm.wrench.tolist(), *pose, *twist),
        *(arm.io.digital_inputs, *[TEMPERATURE_C] * 6, CYCLE_S, 0.0, arm.robot_mode),
        *(*[joint_mode(program)] * 6, arm.safety, *[0.0] * 6, *[nan] * 3, *[0.0] * 6),
        *(speed_scaling(program), nan, 0.0, 0.0, SUPPLY_V, SUPPLY_V, nan, *[SUPPLY_V] * 6),
        *(arm.io.digital_outputs, program.runtime, *elbow_position(program), *elbow_velocity(program)),
        *(arm.safety, 0.0, 0.0, 0.0, arm.payload_kg, *arm.payload_cog_m, *arm.payload_inertia),
    )
