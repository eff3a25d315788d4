"""No gripper: every command succeeds and nothing is held."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from hecbench.registry import hookimpl
from hecbench.specs import DeviceSpec, Kind
from hecbench_hardware.devices import GripperStatus


@dataclass
class NoGripper:
    """Stands in where a program wants a gripper."""

    name: str = "none"

    def enable(self) -> None:
        """Nothing."""

    def open_fingers(self, width_m: float | None = None) -> None:
        """Nothing."""

    def close_fingers(self, force_n: float | None = None) -> GripperStatus:
        """Nothing, holding nothing."""
        return self.status()

    def status(self) -> GripperStatus:
        """Still and empty."""
        return GripperStatus(width_m=None, moving=False, holding=False)

    def stop(self) -> None:
        """Nothing."""

    def close(self) -> None:
        """Nothing."""


@hookimpl
def hecbench_grippers() -> Iterable[DeviceSpec]:
    """The absence of a gripper."""
    yield DeviceSpec(
        name="none", kind=Kind.GRIPPER, summary="no gripper", open=lambda _: NoGripper(), simulated=True
    )
