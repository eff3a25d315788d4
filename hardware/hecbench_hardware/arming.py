"""The one way in which a program takes control of an arm."""

from __future__ import annotations

from collections.abc import Callable

from hecbench.errors import InputError
from hecbench_hardware.devices import Robot


def take_control(robot: Robot, what: str, *, armed: bool, confirm: Callable[[str], bool]) -> None:
    """Enable an arm. One that is not simulated only when armed, and when the operator confirms `what`.

    Raises:
        InputError: It is real and not armed, or not confirmed.
        DeviceFault: It is not ready.
    """
    if not robot.simulated:
        if not armed:
            raise InputError(f"{robot.name} is real and stays read-only: add --arm to let it move")
        speed = f"{robot.limits.joint_speed_rad_s:.2f} rad/s, {robot.limits.tool_speed_m_s:.2f} m/s"
        if not confirm(f"{robot.name} will move: {what}, at most {speed}. Is the cell clear?"):
            raise InputError(f"{robot.name} does not move: not confirmed")
    robot.enable()
