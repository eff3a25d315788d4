"""Digital outputs and the speed slider of a UR controller, through a worker of their own.

A controller lets one client write them at a time.
"""

from __future__ import annotations

from typing import Self

from hecbench.errors import HecbenchError
from hecbench_hardware.devices import DeviceFault, Fault
from hecbench_hardware.ur.dashboard import probe
from hecbench_hardware.ur.process import Worker, WorkerGone
from hecbench_hardware.ur.recovery import explained


class Outputs:
    """Connected until `close`."""

    def __init__(self, host: str) -> None:
        """Connect; raises `DeviceFault` when the controller does not answer or another client has them."""
        self._device = f"outputs of {host}"
        probe(host)
        self._worker: Worker | None = Worker("outputs", host)
        try:
            self._worker.ready()
        except (WorkerGone, HecbenchError) as error:
            raise explained(self._device, str(error)) from None

    def call(self, name: str, *args: object) -> None:
        """A method of RTDEIOInterface; raises `DeviceFault` when it was not done."""
        if self._worker is None:
            raise DeviceFault(Fault.LINK_LOST, self._device, f"{name} was not done: the link is gone")
        try:
            done = self._worker.request("call", name, *args)
        except WorkerGone as error:
            self._worker = None
            raise explained(self._device, str(error)) from None
        if not done:
            raise DeviceFault(Fault.LINK_LOST, self._device, f"{name} was not done")

    def close(self) -> None:
        """Disconnect; the outputs stay as they are. May be called twice."""
        worker, self._worker = self._worker, None
        if worker:
            worker.leave()

    def __enter__(self) -> Self:
        """The outputs themselves."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close."""
        self.close()
