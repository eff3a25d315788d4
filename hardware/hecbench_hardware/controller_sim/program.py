"""Programs on the simulated controller: the client's control script, and a few literal lines of any other.

The uploaded text is not interpreted. What the control script does with its registers (command number in,
state and result out) is done here instead, one pass per cycle.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial
from typing import Final

import numpy as np

from hecbench.se3 import Array
from hecbench_hardware.controller_sim.arm import Motion, ScriptError, SimulatedArm, pose_of, vector_of
from hecbench_hardware.controller_sim.signals import RobotMode, RuntimeState, SafetyMode

READY, DONE = 1, 2
CYCLE_S = 0.002
_LEAVE = 255
_REPEATED = frozenset({6, 9, 10, 11, 24, 25, 26, 27, 38, 58, *range(66, 72)})
"""Commands that the script runs in every cycle while their number stays in the register."""
_ACCEPTED = frozenset({6, 7, 8, 20, 21, 41, 42, 56, 57, 59, 62, 63, 64, 65, *range(66, 72)})
"""Commands without an effect here: forces, sensors, torques."""
_STEADY_RAD_S = 1e-6
_NUMBER = r"[-+0-9.eE]+"
_MOVE = re.compile(rf"move([jlp])\((p?)\[([^\]]*)\],\s*a=({_NUMBER}),\s*v=({_NUMBER})")
_HAND_SPEED_RAD_S, _HAND_ACCELERATION_RAD_S2 = 0.5, 5.0


class ProgramRunner:
    """Runs one program and its threads on the arm, one `step` per cycle."""

    def __init__(self, arm: SimulatedArm) -> None:
        self.arm = arm
        self.runtime = RuntimeState.STOPPED
        self.freedrive = False
        self.watchdog_hz = 0.0
        self.wall_s = 0.0
        self.last_input_s = 0.0
        self._program: Motion | None = None
        self._threads: dict[str, Motion] = {}
        self._hand: Motion | None = None
        self._offset = 0
        self._path: list[tuple[str, bool, Array, float, float]] = []
        self._writes = self._operation = 0
        self._servo_target = self._speed_target = np.zeros(6)
        self._speed_of_tool = False
        self._quick: dict[int, Callable[[], None]] = self._handlers()

    # one cycle

    def step(self) -> None:
        """Advance the program, its threads and the arm by one cycle."""
        arm = self.arm
        arm.time_s += arm.dt_s
        self.wall_s += CYCLE_S
        if self.watchdog_hz and self.wall_s - self.last_input_s > 1 / self.watchdog_hz:
            arm.note("watchdog: the client is silent")
            self.kill()
        try:
            for name, thread in list(self._threads.items()):
                if next(thread, self) is self:
                    self._threads.pop(name, None)
            if self._program and next(self._program, self) is self:
                self.kill()
        except ScriptError as error:
            arm.note(str(error))
            self.kill()
        if self._hand and (not self.freedrive or next(self._hand, self) is self):
            self._hand = None
        arm.update_contact()
        if arm.safety is not SafetyMode.NORMAL and self.runtime is RuntimeState.PLAYING:
            self.kill()

    def kill(self) -> None:
        """End the program where it is; the arm stands still."""
        self._program, self._threads = None, {}
        self.runtime, self.freedrive, self.watchdog_hz = RuntimeState.STOPPED, False, 0.0
        self.arm.joint_speeds = np.zeros(6)

    def push_by_hand(self, joints_rad: Array) -> None:
        """Guide the arm to joints (6,) rad, as an operator does in freedrive."""
        self._hand = self.arm.move_joints(joints_rad, _HAND_SPEED_RAD_S, _HAND_ACCELERATION_RAD_S2)

    def load(self, text: str) -> None:
        """Start a program that arrived on a script port."""
        self.kill()
        if self.arm.robot_mode is not RobotMode.RUNNING or self.arm.safety is not SafetyMode.NORMAL:
            self.arm.note("program refused: the arm is not running")
            return
        if "def rtde_control" in text:
            offset = re.search(r"# int register offset\n(\d+)", text)
            self._offset = int(offset[1]) if offset else 0
            injected = text.split("# inject move path\n", 1)[-1].split("\n    end", 1)[0]
            self._path = [
                (kind, bool(is_pose), np.array([float(x) for x in values.split(",")]), float(a), float(v))
                for kind, is_pose, values, a, v in _MOVE.findall(injected)
            ]
            self._program = self._control_script()
        else:
            self._program = self._lines(text)
        self.runtime = RuntimeState.PLAYING

    # the client's control script

    def _control_script(self) -> Motion:
        self._report_progress(None)
        self._set_state(READY)
        executed = False
        while True:
            command = self.arm.int_inputs[self._offset]
            if command == 0:
                executed = False
                self._set_state(READY)
            elif command == _LEAVE:
                return
            elif command in _REPEATED:
                yield from self._execute(command)
                self._set_state(READY)
            elif not executed:
                yield from self._execute(command)
                self._set_state(DONE)
                executed = True
            yield

    def _execute(self, command: int) -> Motion:
        if command in (1, 2, 3, 4, 45):
            self._stop_async_move()
            yield from self._start(self._motion(command))
        elif command in (33, 34):
            self._stop_async_move()
            yield from self.arm.brake(self._doubles(0, 1)[0])
        elif command == 51:
            yield from self._until_contact()
        elif command in self._quick:
            self._quick[command]()
        elif command not in _ACCEPTED:
            self.arm.note(f"unknown command {command}")

    def _handlers(self) -> dict[int, Callable[[], None]]:
        """Commands that take no time, by number."""
        arm, d, put, put_int = self.arm, self._doubles, self._put, self._put_int
        pose = partial(self._pose_argument, 0)
        return {
            9: partial(self._speed, of_tool=False),
            10: partial(self._speed, of_tool=True),
            11: lambda: self._servo(d(0)),
            12: lambda: self._servo(arm.solve(pose(), arm.joints)),
            15: lambda: self._end_thread("speed"),
            16: lambda: self._end_thread("servo"),
            17: self._set_payload,
            18: lambda: self._set_freedrive(True),
            19: lambda: self._set_freedrive(False),
            24: lambda: self._servo(arm.solve(pose(), arm.joints)),
            25: lambda: put_int(int(arm.wrench[2] > 0)),
            26: lambda: put(np.array([arm.dt_s])),
            27: lambda: put(arm.joints),
            28: lambda: put(vector_of(arm.base_T_tcp)),
            29: self._set_tcp,
            30: lambda: put(self._inverse(d(6))),
            31: lambda: arm.protective_stop("asked for by the program"),
            35: self._set_watchdog,
            36: lambda: put_int(int(self._reachable(arm.joints))),
            37: lambda: put_int(int(np.abs(d(0)).max() <= arm.arm.joint_range_rad)),
            38: lambda: put(np.zeros(6)),
            39: lambda: put(vector_of(pose() @ self._pose_argument(6))),
            40: lambda: put(arm.tcp_offset),
            43: lambda: put(vector_of(arm.base_T_tcp)),
            44: lambda: put(vector_of(arm.arm.forward(d(0)) @ self._pose_argument(6))),
            46: lambda: put(self._inverse(arm.joints)),
            47: lambda: put_int(int(np.abs(arm.joint_speeds).max() < _STEADY_RAD_S)),
            52: lambda: self._set_freedrive(True),
            53: lambda: self._set_freedrive(False),
            54: lambda: put_int(0 if self.freedrive else -1),
            58: lambda: put(vector_of(arm.arm.forward(arm.joints))),
            60: lambda: put_int(int(self._reachable(arm.joints))),
            61: lambda: put_int(int(self._reachable(d(6)))),
        }

    # registers

    def _doubles(self, first: int, count: int = 6) -> Array:
        start = self._offset + first
        return np.array(self.arm.double_inputs[start : start + count])

    def _pose_argument(self, first: int) -> Array:
        return pose_of(self._doubles(first))

    def _put(self, values: Array) -> None:
        self.arm.double_outputs[self._offset : self._offset + len(values)] = values.tolist()

    def _put_int(self, value: int) -> None:
        self.arm.int_outputs[self._offset + 1] = value

    def _set_state(self, state: int) -> None:
        self.arm.int_outputs[self._offset] = state

    def _report_progress(self, progress: int | None) -> None:
        """Write the register of asynchronous motions; None means that none runs."""
        self._writes = (self._writes + 1) % 128
        if progress == 0:
            self._operation = (self._operation + 1) % 128
        running = 0 if progress is None else 1 << 15 | min(progress, 0x7FFF)
        self.arm.int_outputs[self._offset + 2] = running | self._writes << 16 | self._operation << 24

    # motions

    def _motion(self, command: int) -> Motion:
        arm, target, (speed, acceleration) = self.arm, self._doubles(0), self._doubles(6, 2)
        if not np.isfinite(self._doubles(0, 8)).all():
            raise ScriptError("a motion needs finite numbers")
        if command == 1:
            return arm.move_joints(target, speed, acceleration)
        if command == 2:
            return arm.move_joints(self._inverse(arm.joints), speed, acceleration)
        if command == 3:
            return arm.move_linear(pose_of(target), speed, acceleration)
        if command == 4:
            return arm.move_linear(arm.arm.forward(target) @ arm.flange_T_tcp, speed, acceleration)
        return self._follow_path()

    def _start(self, motion: Motion) -> Motion:
        if self.arm.int_inputs[self._offset + 1] == 1:
            self._threads["move"] = self._reported(motion)
        else:
            yield from motion

    def _reported(self, motion: Motion) -> Motion:
        self._report_progress(0)
        yield from motion
        self._report_progress(None)

    def _stop_async_move(self) -> None:
        if self._threads.pop("move", None):
            self._report_progress(None)

    def _follow_path(self) -> Motion:
        arm = self.arm
        for k, (kind, is_pose, values, acceleration, speed) in enumerate(self._path):
            self._report_progress(k)
            if kind == "j":
                joints = arm.solve(pose_of(values), arm.joints) if is_pose else values[:6]
                yield from arm.move_joints(joints, speed, acceleration)
            else:
                target = pose_of(values) if is_pose else arm.arm.forward(values[:6]) @ arm.flange_T_tcp
                yield from arm.move_linear(target, speed, acceleration)

    def _until_contact(self) -> Motion:
        twist = self._doubles(0)
        while self.arm.wrench[2] <= 0:
            self.arm.drift(twist)
            yield
        self.arm.joint_speeds = np.zeros(6)

    def _servo(self, target: Array) -> None:
        self._servo_target = target
        self._threads.setdefault("servo", self._keep_servoing())

    def _keep_servoing(self) -> Motion:
        while True:
            self.arm.follow(self._servo_target, np.pi)
            yield

    def _speed(self, *, of_tool: bool) -> None:
        self._speed_of_tool, self._speed_target = of_tool, self._doubles(0)
        self._threads.setdefault("speed", self._keep_speed())

    def _keep_speed(self) -> Motion:
        while True:
            (self.arm.drift if self._speed_of_tool else self.arm.turn)(self._speed_target)
            yield

    def _end_thread(self, name: str) -> None:
        self._threads.pop(name, None)
        self.arm.joint_speeds = np.zeros(6)

    # settings and questions

    def _set_payload(self) -> None:
        self.arm.payload_kg, *self.arm.payload_cog_m = self._doubles(0, 4).tolist()

    def _set_tcp(self) -> None:
        self.arm.tcp_offset = self._doubles(0)
        self.arm.flange_T_tcp = pose_of(self.arm.tcp_offset)

    def _set_watchdog(self) -> None:
        self.watchdog_hz, self.last_input_s = self._doubles(0, 1)[0], self.wall_s

    def _set_freedrive(self, on: bool) -> None:
        self.freedrive = on

    def _inverse(self, near: Array) -> Array:
        return self.arm.solve(self._pose_argument(0), near)

    def _reachable(self, near: Array) -> bool:
        try:
            self._inverse(near)
        except ScriptError:
            return False
        return True

    # any other program

    def _lines(self, text: str) -> Motion:
        """Literal lines only: registers, movej, movel, sleep, digital outputs."""
        yield
        arm = self.arm
        for raw in text.splitlines():
            line = raw.split("#")[0].strip()
            if m := re.match(r"write_output_integer_register\(([^,]+),\s*(-?\d+)\)", line):
                arm.int_outputs[sum(int(x) for x in m[1].split("+"))] = int(m[2])
            elif m := _MOVE.match(line):
                values = np.array([float(x) for x in m[3].split(",")])
                if m[1] == "j":
                    joints = arm.solve(pose_of(values), arm.joints) if m[2] else values
                    yield from arm.move_joints(joints, float(m[5]), float(m[4]))
                else:
                    yield from arm.move_linear(pose_of(values), float(m[5]), float(m[4]))
            elif m := re.match(r"sleep\(([\d.]+)\)", line):
                until = arm.time_s + float(m[1])
                while arm.time_s < until:
                    yield
            elif m := re.match(
                r"set_(standard|configurable|tool)_digital_out\((\d+),\s*(True|False)\)", line
            ):
                bit = 1 << int(m[2]) + OUTPUT_SHIFT[m[1]]
                arm.digital_outputs = arm.digital_outputs & ~bit | (bit if m[3] == "True" else 0)
            yield


OUTPUT_SHIFT: Final = {"standard": 0, "configurable": 8, "tool": 16}
"""First bit of each bank of digital outputs."""
