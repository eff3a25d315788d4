"""What runs on the simulated controller: one program and its secondary programs, one `step` per cycle."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from functools import partial

import numpy as np

from hecbench.se3 import Array
from hecbench_hardware.controller_sim.arm import ScriptError, SimulatedArm
from hecbench_hardware.controller_sim.force import ForceTask
from hecbench_hardware.controller_sim.motions import Motion, move_joints
from hecbench_hardware.controller_sim.robot_messages import Messages
from hecbench_hardware.controller_sim.robotiq import RobotiqSocket
from hecbench_hardware.controller_sim.signals import RobotMode, RuntimeState, SafetyMode

CYCLE_S = 0.002
_HAND_SPEED_RAD_S, _HAND_ACCELERATION_RAD_S2 = 0.5, 5.0
_SECONDARY_PROGRAMS = 32

Program = Generator[None, None, None]
"""Every `next` runs a program for one cycle."""


@dataclass(frozen=True)
class Watchdog:
    """Ends or pauses the program when a client writes an input less often than asked."""

    input_name: str
    frequency_hz: float
    action: str
    since_s: float


class ProgramRunner:
    """Runs programs on the arm. Starting one ends the one before, as on the controller."""

    def __init__(
        self, arm: SimulatedArm, gripper: RobotiqSocket | None = None, host: str = "127.0.0.1"
    ) -> None:
        self.arm = arm
        self.gripper = gripper or RobotiqSocket()
        self.host = host
        self.messages = Messages()
        self.runtime = RuntimeState.STOPPED
        self.name = "<unnamed>"
        self.line = 0
        """Line of the program that runs now."""
        self.remote = True
        """Whether programs of clients are taken; the pendant's switch."""
        self.freedrive = False
        self.force: ForceTask | None = None
        self.watchdog: Watchdog | None = None
        self.popup: str | None = None
        """The window that waits on the pendant for somebody to close it."""
        self.wall_s = 0.0
        self.cycle = 0
        self.input_written_s: dict[str, float] = {}
        """When each RTDE input was written last, by the wall clock's cycles."""
        self._program: Program | None = None
        self._secondary: list[Program] = []
        self._hand: Motion | None = None
        self._admitted: set[str] = set()

    def step(self) -> None:
        """Advance the programs and the arm by one cycle."""
        arm = self.arm
        arm.begin_cycle()
        self.wall_s += CYCLE_S
        self.cycle += 1
        self._watch_inputs()
        self._run_secondary()
        if self._program and self.runtime is RuntimeState.PLAYING:
            self._guarded(partial(self._advance, self._program))
        if self.force and not arm.moved:
            self._guarded(partial(self.force.step, arm))
        if self._hand and (not self.freedrive or next(self._hand, self) is self):
            self._hand = None
        arm.end_cycle()
        self.gripper.step(arm.dt_s)
        if arm.safety is not SafetyMode.NORMAL and self.runtime is not RuntimeState.STOPPED:
            self.kill()

    def start(self, program: Program, name: str) -> None:
        """Run a program; refused, and noted, while the arm cannot move."""
        self.kill()
        if not self.remote:
            self.refuse(f"program {name} refused: the arm is in local control")
            return
        if self.arm.robot_mode is not RobotMode.RUNNING or self.arm.safety is not SafetyMode.NORMAL:
            self.refuse(f"program {name} refused: the arm is not running")
            return
        self._program, self.name, self.runtime = program, name, RuntimeState.PLAYING
        self._admitted.clear()

    def start_secondary(self, program: Program) -> None:
        """Run a program beside the main one; it must not take time on the arm."""
        if len(self._secondary) >= _SECONDARY_PROGRAMS:
            self.refuse("too many secondary programs at once")
            return
        self._secondary.append(program)

    def kill(self) -> None:
        """End the program where it is; the arm stands still."""
        program, self._program = self._program, None
        if program:
            program.close()
        self.runtime, self.freedrive, self.force, self.watchdog = RuntimeState.STOPPED, False, None, None
        self.popup, self.line = None, 0
        self.arm.joint_speeds = np.zeros(6)

    def pause(self) -> bool:
        """Hold the program where it is; false when none runs."""
        if self.runtime is not RuntimeState.PLAYING:
            return False
        self.runtime = RuntimeState.PAUSED
        return True

    def resume(self) -> bool:
        """Go on with a paused program; false when none is."""
        if self.runtime is not RuntimeState.PAUSED:
            return False
        self.runtime = RuntimeState.PLAYING
        return True

    def push_by_hand(self, joints_rad: Array) -> None:
        """Guide the arm to joints (6,) rad, as an operator does in freedrive."""
        self._hand = move_joints(self.arm, joints_rad, _HAND_SPEED_RAD_S, _HAND_ACCELERATION_RAD_S2)

    def admit(self, what: str) -> None:
        """Say, once a program, what it asks for and does not get: in the log and to the primary clients."""
        if what not in self._admitted:
            self._admitted.add(what)
            self.arm.note(f"not simulated: {what}")
            self.messages.text(self.arm.time_s, f"not simulated: {what}")

    def refuse(self, complaint: str, line: int = 0, column: int = 0) -> None:
        """Report what is wrong with a program in the log and on the primary interface."""
        where = f"line {line}: " if line else ""
        self.arm.note(f"program error: {where}{complaint}")
        self.messages.program_error(self.arm.time_s, line, column, complaint)

    def _advance(self, program: Program) -> None:
        if next(program, self) is self and self._program is program:
            self.kill()

    def _guarded(self, cycle: Callable[[], None]) -> None:
        """One cycle of the program; its fault ends it, and is reported."""
        try:
            cycle()
        except ScriptError as error:
            self.refuse(str(error), error.line or self.line)
            self.kill()

    def _run_secondary(self) -> None:
        for program in list(self._secondary):
            try:
                if next(program, self) is not self:
                    continue
            except ScriptError as error:
                self.refuse(str(error), error.line)
            self._secondary.remove(program)

    def _watch_inputs(self) -> None:
        dog = self.watchdog
        if not dog:
            return
        last = max(self.input_written_s.get(dog.input_name, 0.0), dog.since_s)
        if self.wall_s - last > 1 / dog.frequency_hz:
            self.arm.note("watchdog: the client is silent")
            if dog.action == "pause":
                self.pause()
            elif dog.action == "stop":
                self.kill()
            self.watchdog = None
