"""A gripper that one digital output of a UR controller opens and closes; it cannot be felt, so it waits."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hecbench.errors import InputError
from hecbench.registry import hookimpl
from hecbench.specs import DeviceSpec, Kind
from hecbench_hardware.devices import GripperStatus
from hecbench_hardware.grippers.guard import Guarded
from hecbench_hardware.options import flag, number, text

if TYPE_CHECKING:
    from hecbench_hardware.ur.outputs import Outputs

_COUNTS = {"Standard": 8, "Configurable": 8, "Tool": 2}


@dataclass
class DigitalOutputGripper(Guarded):
    """Output on is closed, unless inverted."""

    outputs: Outputs
    bank: str
    number: int
    closes_when_on: bool = True
    stroke_s: float = 0.5
    name: str = "digital output gripper"

    def open_fingers(self, width_m: float | None = None) -> None:
        """Open; there is only one width."""
        if width_m is not None:
            raise InputError(f"{self.name}: cannot open to a width, it has one output; leave the width out")
        self._switch(on=not self.closes_when_on)

    def close_fingers(self, force_n: float | None = None) -> GripperStatus:
        """Close; there is only one force."""
        if force_n is not None:
            raise InputError(f"{self.name}: cannot set a force, it has one output; leave the force out")
        self._switch(on=self.closes_when_on)
        return self.status()

    def status(self) -> GripperStatus:
        """Nothing is known but that the time of a stroke has passed."""
        return GripperStatus(width_m=None, moving=False, holding=False)

    def stop(self) -> None:
        """A valve cannot stop half-way."""

    def close(self) -> None:
        """Disconnect; the output stays."""
        self.outputs.close()

    def _switch(self, *, on: bool) -> None:
        self.refuse_disabled()
        self.outputs.call(f"set{self.bank}DigitalOut", self.number, on)
        time.sleep(self.stroke_s)


def open_digital_output(options: Mapping[str, str]) -> DigitalOutputGripper:
    """Connect to the outputs of a controller."""
    from hecbench_hardware.ur.outputs import Outputs

    bank, index = text(options, "bank", "Tool").capitalize(), int(number(options, "number", 0))
    if index not in range(_COUNTS.get(bank, 0)):
        banks = ", ".join(f"{name} 0-{count - 1}" for name, count in _COUNTS.items())
        raise InputError(f"there is no output bank={bank} number={index}: choose among {banks}")
    return DigitalOutputGripper(
        Outputs(text(options, "host")),
        bank,
        index,
        closes_when_on=not flag(options, "inverted"),
        stroke_s=number(options, "stroke_s", 0.5),
    )


@hookimpl
def hecbench_grippers() -> Iterable[DeviceSpec]:
    """A gripper on one output."""
    yield DeviceSpec(
        name="digital_output",
        kind=Kind.GRIPPER,
        summary="any gripper on one digital output of a UR controller",
        imports=("rtde_io",),
        open=open_digital_output,
        simulated=False,
        options=("host", "bank", "number", "inverted", "stroke_s"),
    )
