"""Names, widths and codes of RTDE version 2, as the maker's guide "Real-Time Data Exchange" lists them."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

FORMATS: Final = {
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


def _types(kind: str, names: str) -> dict[str, str]:
    return dict.fromkeys(names.split(), kind)


OUTPUTS: Final = {
    **_types(
        "VECTOR6D",
        "target_q target_qd target_qdd target_current target_moment actual_q actual_qd actual_current"
        " joint_control_output actual_TCP_pose actual_TCP_speed actual_TCP_force target_TCP_pose"
        " target_TCP_speed joint_temperatures actual_joint_voltage ft_raw_wrench payload_inertia"
        " actual_current_as_torque",
    ),
    **_types("VECTOR3D", "actual_tool_accelerometer payload_cog"),
    **_types("VECTOR6INT32", "joint_mode"),
    **_types(
        "DOUBLE",
        "timestamp actual_execution_time speed_scaling target_speed_fraction actual_momentum"
        " actual_main_voltage actual_robot_voltage actual_robot_current standard_analog_input0"
        " standard_analog_input1 standard_analog_output0 standard_analog_output1 payload",
    ),
    **_types("INT32", "robot_mode safety_mode"),
    **_types("UINT32", "runtime_state robot_status_bits safety_status_bits"),
    **_types("UINT64", "actual_digital_input_bits actual_digital_output_bits"),
    **{f"output_int_register_{i}": "INT32" for i in range(REGISTERS)},
    **{f"output_double_register_{i}": "DOUBLE" for i in range(REGISTERS)},
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
    **{f"input_int_register_{i}": "INT32" for i in range(REGISTERS)},
    **{f"input_double_register_{i}": "DOUBLE" for i in range(REGISTERS)},
}
"""RTDE type of every input that the controller knows."""


class RuntimeState(IntEnum):
    """What the program on the controller does."""

    STOPPED = 1
    PLAYING = 2


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
