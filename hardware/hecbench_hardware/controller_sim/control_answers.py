"""Answers to the questions of the ur_rtde client, by the number of the command."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from hecbench.se3 import Array
from hecbench_hardware.controller_sim.geometry import vector_of

if TYPE_CHECKING:
    from hecbench_hardware.controller_sim.control_script import ControlScript

_DERIVATIVE_STEP_S = 1e-6

Answer = TypeVar("Answer")


class Answers:
    """Bound to one run of the control script."""

    def __init__(self, script: ControlScript) -> None:
        self._script, self._arm = script, script.arm
        answers: dict[int, Callable[[], Array | list[float]]] = {
            26: lambda: [self._arm.dt_s],
            27: self._history,
            28: self._waypoint,
            30: lambda: self._inverse(script.doubles(6)),
            38: lambda: self._arm.torques,
            39: lambda: vector_of(script.pose(0) @ script.pose(6)),
            40: lambda: self._arm.tcp_offset,
            43: lambda: vector_of(self._arm.base_T_tcp),
            44: lambda: vector_of(self._arm.arm.forward(script.doubles(0)) @ script.pose(6)),
            46: lambda: self._inverse(self._arm.joints),
            58: lambda: vector_of(self._arm.arm.forward(self._arm.joints)),
            67: lambda: self._arm.dynamics.mass_matrix(self._arm.joints),
            68: lambda: self._arm.dynamics.coriolis(self._arm.joints, self._arm.joint_speeds),
            69: lambda: self._arm.joint_accelerations,
            70: lambda: self._arm.jacobian().T,
            71: self._jacobian_rate,
        }
        verdicts: dict[int, Callable[[], int]] = {
            25: lambda: int(self._arm.feels_contact(script.doubles(0, 3))),
            36: lambda: int(self._arm.is_reachable(script.pose(0), self._arm.joints)),
            37: lambda: int(np.abs(script.doubles(0)).max() <= self._arm.arm.joint_range_rad),
            47: lambda: int(self._arm.is_steady()),
            54: lambda: 0 if script.runner.freedrive else -1,
            60: lambda: int(self._arm.is_reachable(script.pose(0), self._arm.joints)),
            61: lambda: int(self._arm.is_reachable(script.pose(0), script.doubles(6))),
            63: self._end_contact_detection,
            64: lambda: script.contact_cycles or 0,
        }
        self.handlers: dict[int, Callable[[], None]] = {
            **{number: _shown(script.put, answer) for number, answer in answers.items()},
            **{number: _shown(script.put_int, verdict) for number, verdict in verdicts.items()},
        }

    def _inverse(self, near: Array) -> Array:
        return self._arm.solve(self._script.pose(0), near)

    def _history(self) -> Array:
        steps, history = self._script.integer(1), self._arm.history
        return history[-1 - steps] if 0 <= steps < len(history) else np.full(6, np.nan)

    def _waypoint(self) -> Array:
        waypoint = self._script.waypoint
        return vector_of(self._arm.base_T_tcp) if waypoint is None else waypoint

    def _jacobian_rate(self) -> Array:
        arm = self._arm
        later = arm.jacobian(arm.joints + arm.joint_speeds * _DERIVATIVE_STEP_S)
        return np.asarray((later - arm.jacobian()).T / _DERIVATIVE_STEP_S)

    def _end_contact_detection(self) -> int:
        steps = self._script.contact_cycles or 0
        self._script.contact_cycles = None
        return steps


def _shown(put: Callable[[Answer], None], answer: Callable[[], Answer]) -> Callable[[], None]:
    return lambda: put(answer())
