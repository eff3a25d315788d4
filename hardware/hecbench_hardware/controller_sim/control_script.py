"""The control script of the ur_rtde client, done here instead of interpreted: a command number in, its result out.

One pass per cycle, as the script makes one. A result stays in the output registers for a while after its question is
over, at most until the next one; then they hold NaN: a client that reads too early finds no answer, never the answer to
another question.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial
from typing import Final

import numpy as np

from hecbench.se3 import Array
from hecbench_hardware.controller_sim.arm import ScriptError
from hecbench_hardware.controller_sim.control_answers import Answers
from hecbench_hardware.controller_sim.control_registers import ControlRegisters
from hecbench_hardware.controller_sim.force import ForceTask
from hecbench_hardware.controller_sim.geometry import pose_of, vector_of
from hecbench_hardware.controller_sim.motions import Motion, brake, move_joints, move_linear
from hecbench_hardware.controller_sim.program import Program, ProgramRunner, Watchdog
from hecbench_hardware.controller_sim.urscript.unsimulated import BLEND

READY, DONE = 1, 2
NAME = "rtde_control"
MARK = f"def {NAME}("
"""How the text of this script is known."""
_LEAVE = 255
_REPEATED: Final = frozenset({6, 9, 10, 11, 24, 25, 26, 27, 38, 58, *range(66, 72)})
"""Commands that the script runs in every cycle while their number stays in the register."""
_HOLD_CYCLES = 10
"""How long numbers stay after the client took its question back."""
_HOLD_VERDICT_S = 0.1
"""How long a verdict does, by the clock of the client's computer: no busy client may take its absence for a no."""
_NUMBER = r"[-+0-9.eE]+"
_MOVE = re.compile(rf"move([jlp])\((p?)\[([^\]]*)\],\s*a=({_NUMBER}),\s*v=({_NUMBER})(?:,\s*r=({_NUMBER}))?")
_SERVO_DECELERATION_RAD_S2 = 10.0


class ControlScript(ControlRegisters):
    """One run of the script."""

    def __init__(self, runner: ProgramRunner, text: str) -> None:
        offset = re.search(r"# int register offset\n(\d+)", text)
        super().__init__(runner, int(offset[1]) if offset else 0)
        injected = text.split("# inject move path\n", 1)[-1].split("\n    end", 1)[0]
        self._path = [
            (kind, bool(is_pose), np.array([float(x) for x in values.split(",")]), float(a), float(v))
            for kind, is_pose, values, a, v, _ in _MOVE.findall(injected)
        ]
        self._blends = any(float(r or 0) > 0 for *_, r in _MOVE.findall(injected))
        self._threads: dict[str, Motion] = {}
        self._servo_target = self._speed_target = self._speed_now = np.zeros(6)
        self._speed_acceleration = 0.0
        self._speed_of_tool = False
        self._asked_s = -np.inf
        self.waypoint: Array | None = None
        """Where the present motion goes, as a pose vector."""
        self.contact_cycles: int | None = None
        """Cycles since the first contact that contact detection saw; None while it is off."""
        self._contact_direction = np.zeros(3)
        self._answers = Answers(self)
        self._actions = self._handlers()

    def run(self) -> Program:
        """The script's main loop beside its threads."""
        self.report_progress(None)
        self.forget()
        self.set_state(READY)
        main = self._loop()
        while True:
            for name, thread in list(self._threads.items()):
                if next(thread, self) is self:
                    self._threads.pop(name, None)
            self._watch_contact()
            if next(main, self) is self:
                return
            yield

    def _loop(self) -> Motion:
        last = cycles = 0
        while True:
            command = self.arm.io.inputs.ints[self.register(0)]
            if command == _LEAVE:
                return
            is_new, last = command != last, command
            if command == 0:
                cycles += 1
                if cycles > _HOLD_CYCLES or not self.shown:
                    self.forget_numbers()
                    self.set_state(READY)
                if self.runner.wall_s - self._asked_s > _HOLD_VERDICT_S:
                    self.put_int(0)
            else:
                cycles = 0
                if is_new:
                    self.forget()
                if command in _REPEATED:
                    if self.is_fresh():
                        yield from self._execute(command)
                    else:
                        self.forget()
                    self.set_state(READY)
                else:
                    if is_new:
                        yield from self._execute(command)
                        self.set_state(DONE)
                    self._asked_s = self.runner.wall_s
            yield

    def _execute(self, command: int) -> Motion:
        if command in (1, 2, 3, 4, 45):
            self._stop_async_move()
            yield from self._start(self._motion(command))
        elif command in (33, 34):
            self._stop_async_move()
            yield from brake(self.arm, self.doubles(0, 1)[0])
        elif command in (15, 16, 42):
            deceleration = self.doubles(0, 1)[0] if command == 15 else _SERVO_DECELERATION_RAD_S2
            for name in ("speed", "servo", "jog"):
                self._threads.pop(name, None)
            yield from brake(self.arm, deceleration)
        elif command == 51:
            yield from self._until_contact()
        elif action := self._actions.get(command) or self._answers.handlers.get(command):
            action()
        else:
            raise ScriptError(f"command {command} of the control script is not simulated")

    def _handlers(self) -> dict[int, Callable[[], object]]:
        """Commands that take no time and answer nothing, by number."""
        runner, arm, d = self.runner, self.arm, self.doubles
        freedrive = partial(setattr, runner, "freedrive")
        no_effect = partial(
            runner.admit, "damping and gain of force_mode: the force loop has no inertia and one gain"
        )
        return {
            6: self._force_mode,
            7: lambda: setattr(runner, "force", None),
            8: arm.zero_force,
            9: partial(self._speed, of_tool=False),
            10: partial(self._speed, of_tool=True),
            11: lambda: self._servo(d(0)),
            12: lambda: self._servo(arm.solve(self.pose(0), arm.joints)),
            17: self._set_payload,
            18: lambda: freedrive(True),
            19: lambda: freedrive(False),
            **dict.fromkeys((20, 21), no_effect),
            24: lambda: self._servo(arm.solve(self.pose(0), arm.joints)),
            29: lambda: arm.set_tcp(d(0)),
            31: lambda: arm.protective_stop("asked for by the program"),
            35: self._set_watchdog,
            41: self._jog,
            52: lambda: freedrive(True),
            53: lambda: freedrive(False),
            **dict.fromkeys((56, 57), lambda: setattr(arm, "external_sensor", self.integer(1) == 1)),
            59: lambda: setattr(arm, "gravity", d(0, 3).tolist()),
            62: self._detect_contact,
            66: lambda: arm.push(d(0)),
            65: self._set_payload,
        }

    # motions

    def _motion(self, command: int) -> Motion:
        arm, target, (speed, acceleration) = self.arm, self.doubles(0), self.doubles(6, 2)
        if not np.isfinite(self.doubles(0, 8)).all():
            raise ScriptError("a motion needs finite numbers")
        if command == 45:
            return self._follow_path()
        joints = target if command in (1, 4) else arm.solve(pose_of(target), arm.joints)
        flange = arm.arm.forward(joints) @ arm.flange_T_tcp
        self.waypoint = vector_of(flange)
        if command in (1, 2):
            return move_joints(arm, joints, speed, acceleration)
        return move_linear(arm, pose_of(target) if command == 3 else flange, speed, acceleration)

    def _start(self, motion: Motion) -> Motion:
        if self.integer(1) == 1:
            self._threads["move"] = self._reported(motion)
        else:
            yield from motion

    def _reported(self, motion: Motion) -> Motion:
        self.report_progress(0)
        yield from motion
        self.report_progress(None)

    def _stop_async_move(self) -> None:
        if self._threads.pop("move", None):
            self.report_progress(None)

    def _follow_path(self) -> Motion:
        arm = self.arm
        if self._blends:
            self.runner.admit(f"a path's {BLEND.said(1)}")
        for k, (kind, is_pose, values, acceleration, speed) in enumerate(self._path):
            self.report_progress(k)
            if kind == "j":
                joints = arm.solve(pose_of(values), arm.joints) if is_pose else values[:6]
                yield from move_joints(arm, joints, speed, acceleration)
            else:
                target = pose_of(values) if is_pose else arm.arm.forward(values[:6]) @ arm.flange_T_tcp
                yield from move_linear(arm, target, speed, acceleration)

    def _until_contact(self) -> Motion:
        twist, direction = self.doubles(0), self.doubles(6, 3)
        towards = direction if direction.any() else twist[:3]
        while not self.arm.feels_contact(towards):
            self.arm.drift(twist)
            yield

    def _servo(self, target: Array) -> None:
        self.runner.admit(
            "servoj(), servoc(): gain and lookahead_time: the arm follows as fast as its joints may"
        )
        self._servo_target = target
        self._threads.setdefault("servo", self._keep_servoing())

    def _keep_servoing(self) -> Motion:
        while True:
            self.arm.follow(self._servo_target, np.pi)
            yield

    def _speed(self, *, of_tool: bool) -> None:
        self._speed_of_tool, self._speed_target = of_tool, self.doubles(0)
        self._speed_acceleration = max(float(self.doubles(6, 1)[0]), 1e-3)
        if "speed" not in self._threads:
            self._speed_now = np.zeros(6)
            self._threads["speed"] = self._keep_speed()

    def _keep_speed(self) -> Motion:
        while True:
            change = self._speed_target - self._speed_now
            step = self._speed_acceleration * self.arm.dt_s
            self._speed_now = self._speed_now + change * min(1.0, step / max(np.abs(change).max(), 1e-12))
            (self.arm.drift if self._speed_of_tool else self.arm.turn)(self._speed_now)
            yield

    def _jog(self) -> None:
        speeds, feature = self.doubles(0), self.doubles(6, 1)[0]
        rotations = {0: np.eye(3), 1: self.arm.base_T_tcp[:3, :3], 2: self.pose(8)[:3, :3]}
        rotation = rotations.get(int(feature), rotations[0])
        twist = np.concatenate([rotation @ speeds[:3], rotation @ speeds[3:]])
        self._threads["jog"] = self._keep_jogging(twist)

    def _keep_jogging(self, twist: Array) -> Motion:
        while True:
            self.arm.drift(twist)
            yield

    # settings

    def _force_mode(self) -> None:
        selection = np.array([self.integer(i) for i in range(2, 8)], bool)
        frame = self.pose(0)[:3, :3]
        self.runner.force = ForceTask(frame, selection, self.doubles(6), self.doubles(12))

    def _set_payload(self) -> None:
        arm = self.arm
        arm.payload_kg, *cog = self.doubles(0, 4).tolist()
        arm.payload_cog_m = cog if any(cog) else arm.payload_cog_m

    def _set_watchdog(self) -> None:
        hertz = float(self.doubles(0, 1)[0])
        if hertz > 0:
            name = f"input_int_register_{self.register(0)}"
            self.runner.watchdog = Watchdog(name, hertz, "stop", self.runner.wall_s)

    def _detect_contact(self) -> None:
        self.contact_cycles, self._contact_direction = 0, self.doubles(0, 3)

    def _watch_contact(self) -> None:
        felt = self.contact_cycles is not None and self.arm.feels_contact(self._contact_direction)
        if self.contact_cycles is None or (self.contact_cycles == 0 and not felt):
            return
        if self.contact_cycles == 0:
            self._stop_async_move()
        self.contact_cycles += 1
