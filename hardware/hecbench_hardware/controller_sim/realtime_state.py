"""The frame of the real-time interface (maker's "Real-time 5.10"): its length, then 152 doubles."""

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

_LAYOUT = struct.Struct(">i152d")
_UNKNOWN = [nan] * 6
"""Currents and moments: no dynamics."""


def realtime_state(program: ProgramRunner) -> bytes:
    """The state of this cycle."""
    arm = program.arm
    joints, speeds = arm.joints.tolist(), arm.joint_speeds.tolist()
    pose, twist = arm.tcp_vector, arm.tcp_speed
    return _LAYOUT.pack(
        _LAYOUT.size,
        *(arm.time_s, *joints, *speeds, *arm.joint_accelerations.tolist(), *_UNKNOWN, *_UNKNOWN),
        *(*joints, *speeds, *_UNKNOWN, *_UNKNOWN, *pose, *twist, *arm.wrench.tolist(), *pose, *twist),
        *(arm.io.digital_inputs, *[TEMPERATURE_C] * 6, CYCLE_S, 0.0, arm.robot_mode),
        *(*[joint_mode(program)] * 6, arm.safety, *[0.0] * 6, *[nan] * 3, *[0.0] * 6),
        *(speed_scaling(program), nan, 0.0, 0.0, SUPPLY_V, SUPPLY_V, nan, *[SUPPLY_V] * 6),
        *(arm.io.digital_outputs, program.runtime, *elbow_position(program), *elbow_velocity(program)),
        *(arm.safety, 0.0, 0.0, 0.0, arm.payload_kg, *arm.payload_cog_m, *arm.payload_inertia),
    )
