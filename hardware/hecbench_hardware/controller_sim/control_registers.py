"""The registers through which the ur_rtde client and its control script talk."""

from __future__ import annotations

from math import nan

import numpy as np

from hecbench.se3 import Array
from hecbench_hardware.controller_sim.geometry import pose_of
from hecbench_hardware.controller_sim.program import ProgramRunner

_FRESH_S = 0.01
"""A repeated question that the client has not written for so long is over, so that the next one finds no answer."""


class ControlRegisters:
    """Those of one run of the script: 0 the command and the state, 1 an integer, 2 the progress, doubles."""

    def __init__(self, runner: ProgramRunner, offset: int) -> None:
        self.runner, self.arm, self.offset = runner, runner.arm, offset
        self.shown: set[int] = set(range(6))
        """Result registers that do not hold NaN."""
        self._writes = self._operation = 0

    def register(self, index: int) -> int:
        """Number of a register of the script, counted from its offset."""
        return self.offset + index

    def integer(self, index: int) -> int:
        """An integer argument."""
        return self.arm.io.inputs.ints[self.register(index)]

    def doubles(self, first: int, count: int = 6) -> Array:
        """Arguments (count,) of the command."""
        start = self.register(first)
        return np.array(self.arm.io.inputs.doubles[start : start + count])

    def pose(self, first: int) -> Array:
        """A pose argument (4, 4)."""
        return pose_of(self.doubles(first))

    def put(self, values: Array | list[float]) -> None:
        """Show a result; from the 25th number on it goes on in the upper registers, as the script's does."""
        for i, value in enumerate(np.ravel(values).tolist()):
            index = i if i < 24 else i + 12
            self.arm.io.outputs.doubles[self.register(index)] = value
            self.shown.add(index)

    def put_int(self, value: int) -> None:
        """Show an integer result."""
        self.arm.io.outputs.ints[self.register(1)] = value

    def forget(self) -> None:
        """Show no result any more."""
        self.forget_numbers()
        self.put_int(0)

    def forget_numbers(self) -> None:
        """Show none but an integer."""
        for index in self.shown:
            self.arm.io.outputs.doubles[self.register(index)] = nan
        self.shown.clear()

    def is_fresh(self) -> bool:
        """Whether the client wrote its command just now."""
        written = self.runner.input_written_s.get(f"input_int_register_{self.register(0)}", 0.0)
        return self.runner.wall_s - written < _FRESH_S

    def set_state(self, state: int) -> None:
        """Say that the script is ready, or done with a command."""
        self.arm.io.outputs.ints[self.register(0)] = state

    def report_progress(self, progress: int | None) -> None:
        """Write the register of asynchronous motions; None means that none runs."""
        self._writes = (self._writes + 1) % 128
        if progress == 0:
            self._operation = (self._operation + 1) % 128
        running = 0 if progress is None else 1 << 15 | min(progress, 0x7FFF)
        self.arm.io.outputs.ints[self.register(2)] = running | self._writes << 16 | self._operation << 24
