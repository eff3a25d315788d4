"""Faults on demand: one line of text on the fault port, one line back.

The port is the simulation's own (a real controller has none). Times are seconds of the wall clock.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from hecbench.se3 import Array
from hecbench_hardware.controller_sim.arm import HOME_RAD
from hecbench_hardware.controller_sim.dashboard import Dashboard
from hecbench_hardware.controller_sim.robotiq import RobotiqSocket
from hecbench_hardware.controller_sim.urscript.uploads import start_program

_FAR_M, _STRONG_N = 10.0, 1e4
"""What contact planes and pushes are limited to."""


@dataclass
class Faults:
    """What is broken at the moment, and the verbs that break and mend it."""

    dashboard: Dashboard
    gripper: RobotiqSocket
    link_back_s: float = 0.0
    """When the network is back, by the monotonic clock."""
    stream_frozen: bool = False
    _verbs: dict[str, Callable[[list[float]], None]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Name the verbs."""
        arm, program = self.dashboard.program.arm, self.dashboard.program
        self._verbs = {
            "protective_stop": lambda _: arm.protective_stop("injected"),
            "emergency_stop": lambda _: arm.emergency_stop(),
            "release_emergency_stop": lambda _: arm.release_emergency_stop(),
            "link_loss": lambda x: setattr(
                self, "link_back_s", time.monotonic() + _within(x[0], 0.0, 3600.0)
            ),
            "local_mode": lambda _: self._local_mode(),
            "slow": lambda x: setattr(arm, "slowdown", _within(x[0], 0.0, 1000.0)),
            "stale": lambda _: setattr(self, "stream_frozen", True),
            "unreachable": lambda _: setattr(arm, "nothing_reachable", True),
            "contact": lambda x: setattr(arm, "contact_plane_m", _within(x[0], -_FAR_M, _FAR_M)),
            "push": lambda x: setattr(arm, "external_force_n", _within(x[0], -_STRONG_N, _STRONG_N)),
            "place": self._place,
            "tool": self._set_tool,
            "hand": lambda x: program.push_by_hand(self._six(x)),
            "program": lambda _: start_program(program, "def other():\n sleep(3600)\nend\n"),
            "end_program": lambda _: program.kill(),
            "gripper_jam": lambda _: setattr(self.gripper, "jammed", True),
            "gripper_silent": lambda _: setattr(self.gripper, "silent", True),
            "gripper_object": lambda x: setattr(self.gripper, "object_at", int(_within(x[0], 0, 255))),
            "unmarked": lambda _: setattr(self.dashboard, "marked", False),
            "reset": lambda _: self._reset(),
        }

    @property
    def link_is_down(self) -> bool:
        """Whether nobody can connect."""
        return time.monotonic() < self.link_back_s

    def answer(self, line: str) -> str:
        """Do one verb: `ok`, or what is wrong with the line.

        `log` answers the controller's events, `speed` that of the fastest joint in rad/s.
        """
        name, *words = line.split() or [""]
        arm = self.dashboard.program.arm
        if name == "log":
            return " | ".join(arm.log)
        if name == "speed":
            return str(np.abs(arm.joint_speeds).max())
        if name not in self._verbs:
            return f"unknown fault '{name}': choose one of {', '.join(self._verbs)}, log, speed"
        arm.note(f"injected: {line.strip()}")
        try:
            self._verbs[name]([float(word) for word in words])
        except (ValueError, IndexError):
            return f"wrong numbers in '{line.strip()}'"
        return "ok"

    def _place(self, joints_rad: list[float]) -> None:
        self.dashboard.program.arm.joints = self._six(joints_rad)

    def _six(self, joints_rad: list[float]) -> Array:
        if len(joints_rad) != len(HOME_RAD):
            raise ValueError
        limit = self.dashboard.program.arm.arm.joint_range_rad
        return np.array([_within(value, -limit, limit) for value in joints_rad])

    def _set_tool(self, offset: list[float]) -> None:
        if len(offset) != 6:
            raise ValueError
        vector = np.array([_within(value, -_FAR_M, _FAR_M) for value in offset])
        self.dashboard.program.arm.set_tcp(vector)

    def _local_mode(self) -> None:
        self.dashboard.program.remote = False
        self.dashboard.program.kill()

    def _reset(self) -> None:
        """A controller as it was at the start, at the home pose."""
        program, arm = self.dashboard.program, self.dashboard.program.arm
        program.kill()
        self.dashboard.loaded = ""
        fresh = type(arm)(arm.arm)
        fresh.time_s, fresh.dt_s = arm.time_s, arm.dt_s
        vars(arm).update(vars(fresh))
        arm.joints = np.array(HOME_RAD)
        vars(self.gripper).update(vars(RobotiqSocket()))
        program.remote = self.dashboard.marked = True
        self.stream_frozen, self.link_back_s = False, 0.0


def _within(value: float, low: float, high: float) -> float:
    if not low <= value <= high:
        raise ValueError
    return value
