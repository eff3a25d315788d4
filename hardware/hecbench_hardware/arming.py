"""The one way in which a program takes control of an arm and its gripper, and who lets it go on after a fault."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass

import click

from hecbench.errors import InputError
from hecbench_hardware.devices import Gripper, Robot

MOST_FAULTS = 5
"""So many faults of a real arm may be acknowledged in one run; more of them have one cause that must be found."""


def take_control(
    robot: Robot, what: str, *, armed: bool, confirm: Callable[[str], bool], gripper: Gripper | None = None
) -> None:
    """Enable an arm, then its gripper. One that is not simulated only when armed, and when `what` is confirmed.

    Raises:
        InputError: It is real and not armed, or not confirmed.
        DeviceFault: It is not ready.
    """
    if not robot.simulated:
        if not armed:
            raise InputError(f"{robot.name} is real and stays read-only: add --arm to let it move")
        speed = f"{robot.limits.joint_speed_rad_s:.2f} rad/s, {robot.limits.tool_speed_m_s:.2f} m/s"
        fingers = "" if gripper is None else f", and the fingers of {gripper.name}"
        if not confirm(f"{robot.name} will move: {what}, at most {speed}{fingers}. Is the cell clear?"):
            raise InputError(f"{robot.name} does not move: not confirmed")
    robot.enable()
    if gripper is not None:
        gripper.enable()


@dataclass
class Operator:
    """The person at the terminal.

    `yes` answers the question before the first motion. After that a real arm waits for a person: nobody else
    acknowledges its faults, or says that hands are out of the cell. A simulated arm never waits when `yes` is set,
    and its faults are always acknowledged.
    """

    robot: Robot
    yes: bool = False
    acknowledged: int = 0

    def confirm(self, line: str) -> bool:
        """Before the first motion."""
        return self.yes or click.confirm(line, err=True)

    def ask(self, line: str) -> bool:
        """Later on; no when nobody is at the terminal."""
        if self.robot.simulated and self.yes:
            return True
        return sys.stdin.isatty() and click.confirm(line, err=True)

    def acknowledge(self, fault: str) -> bool:
        """Whether the arm may be made ready again after a fault, which is shown."""
        click.echo(fault, err=True)
        if self.robot.simulated:
            return True
        if self.acknowledged == MOST_FAULTS:
            click.echo(f"{MOST_FAULTS} faults in one run: find their cause, then start again", err=True)
            return False
        self.acknowledged += 1
        return self.ask("Make the arm ready and go on?")
