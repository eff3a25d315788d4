"""Names, widths and codes of RTDE version 2, as the maker's guide "Real-Time Data Exchange" lists them."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

FORMATS: Final = {
    "BOOL": "?",
    "DOUBLE": "d",
    "INT32": "i",
    "UINT32": "I",
    "UINT64": "Q",
    "UINT8": "B",
    "VECTOR3D": "3d",
    "VECTOR6D": "6d",
    "VECTOR6INT32": "6i",
}
"""`struct` codes by RTDE type."""

WIDTHS: Final = {name: int(code[:-1] or 1) for name, code in FORMATS.items()}
"""Numbers per value by RTDE type."""

REGISTERS = 48
"""Integer and double registers of each direction."""
BITS = 128
"""Bit registers of each direction; the first 64 travel in two words, the others one by one."""


def _types(kind: str, names: str) -> dict[str, str]:
    return dict.fromkeys(names.split(), kind)


def register_types(direction: str) -> dict[str, str]:
    """RTDE type of every general purpose register of one direction, `input` or `output`."""
    return {
        f"{direction}_bit_registers0_to_31": "UINT32",
        f"{direction}_bit_registers32_to_63": "UINT32",
        **{f"{direction}_bit_register_{i}": "BOOL" for i in range(64, BITS)},
        **{f"{direction}_int_register_{i}": "INT32" for i in range(REGISTERS)},
        **{f"{direction}_double_register_{i}": "DOUBLE" for i in range(REGISTERS)},
    }


OUTPUTS: Final = {
    **_types(
        "VECTOR6D",
        "target_q target_qd target_qdd target_current target_moment actual_q actual_qd actual_current"
        " actual_current_window actual_current_as_torque joint_control_output actual_TCP_pose"
        " actual_TCP_speed actual_TCP_force target_TCP_pose target_TCP_speed tcp_offset"
        " actual_TCP_acceleration target_TCP_acceleration joint_temperatures actual_joint_voltage"
        " ft_raw_wrench wrench_calc_from_currents payload_inertia target_base_acceleration target_base_wrench",
    ),
    **_types(
        "VECTOR3D", "actual_tool_accelerometer elbow_position elbow_velocity payload_cog target_gravity"
    ),
    **_types("VECTOR6INT32", "joint_mode"),
    **_types(
        "DOUBLE",
        "timestamp actual_execution_time target_execution_time speed_scaling target_speed_fraction"
        " actual_momentum actual_main_voltage actual_robot_voltage actual_robot_current"
        " standard_analog_input0 standard_analog_input1 standard_analog_output0 standard_analog_output1"
        " io_current actual_robot_energy_consumed actual_robot_braking_energy_dissipated"
        " euromap67_24V_voltage euromap67_24V_current tool_analog_input0 tool_analog_input1"
        " tool_output_current tool_temperature tcp_force_scalar joint_position_deviation_ratio"
        " collision_detection_ratio payload",
    ),
    **_types(
        "INT32",
        "robot_mode safety_mode safety_status encoder0_raw encoder1_raw tool_output_voltage time_scale_source",
    ),
    **_types(
        "UINT32",
        "runtime_state robot_status_bits safety_status_bits analog_io_types euromap67_input_bits"
        " euromap67_output_bits tool_mode tool_analog_input_types script_control_line",
    ),
    **_types(
        "UINT64",
        "actual_digital_input_bits actual_digital_output_bits actual_configurable_digital_input_bits"
        " actual_configurable_digital_output_bits control_step",
    ),
    **_types("UINT8", "tool_output_mode tool_digital_output0_mode tool_digital_output1_mode"),
    **register_types("input"),
    **register_types("output"),
}
"""RTDE type of every output that the controller knows."""

INPUTS: Final = {
    **_types("UINT32", "speed_slider_mask"),
    **_types(
        "UINT8",
        "standard_digital_output_mask standard_digital_output configurable_digital_output_mask"
        " configurable_digital_output tool_digital_output_mask tool_digital_output"
        " standard_analog_output_mask standard_analog_output_type",
    ),
    **_types("DOUBLE", "speed_slider_fraction standard_analog_output_0 standard_analog_output_1"),
    **_types("VECTOR6D", "external_force_torque"),
    **register_types("input"),
}
"""RTDE type of every input that the controller knows."""


class RuntimeState(IntEnum):
    """What the program on the controller does."""

    STOPPED = 1
    PLAYING = 2
    PAUSED = 4


class SafetyMode(IntEnum):
    """Why the controller lets the arm move or not."""

    NORMAL = 1
    PROTECTIVE_STOP = 3
    ROBOT_EMERGENCY_STOP = 7


class RobotMode(IntEnum):
    """Power and brakes."""

    POWER_OFF = 3
    IDLE = 5
    RUNNING = 7


SAFETY_BITS: Final = {
    SafetyMode.NORMAL: 1 << 0,
    SafetyMode.PROTECTIVE_STOP: 1 << 2 | 1 << 10,
    SafetyMode.ROBOT_EMERGENCY_STOP: 1 << 6 | 1 << 7 | 1 << 10,
}
"""`safety_status_bits` of each safety mode."""
