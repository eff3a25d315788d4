"""Control of one arm: requests to the worker that has it, motions that are started, watched, and ended or braked."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import numpy as np

from hecbench import se3
from hecbench.errors import HecbenchError, InputError
from hecbench.se3 import Array
from hecbench_hardware.devices import DeviceFault, Fault
from hecbench_hardware.ur import recovery
from hecbench_hardware.ur.dashboard import Dashboard
from hecbench_hardware.ur.process import Worker, WorkerGone
from hecbench_hardware.ur.stream import Sample, StateStream, Supervision, fault_of
from hecbench_hardware.ur.worker import CALL_S, STOP_RAD_S2

POLL_S = 0.001
_BRAKE_S = 0.6
"""Braking from the highest speed, and some."""
_NEWS_S = 0.2
"""How long the news may be on its way why a program ended."""


class Control:
    """Taken when constructed, until `close` or `end`. The first fault stays."""

    def __init__(
        self, name: str, dashboard: Dashboard, stream: StateStream, supervision: Supervision
    ) -> None:
        """Upload the control script, read the tool offset, start to supervise.

        Raises:
            DeviceFault: The controller or another client refuses.
        """
        self._name, self._dashboard, self._stream = name, dashboard, stream
        self._supervision = supervision
        self._fault: DeviceFault | None = None
        self._stopping = threading.Event()
        self._motion = threading.Lock()
        self.worker = Worker(
            "control", dashboard.host, patience_s=supervision.patience_s, leniency=supervision.leniency
        )
        try:
            self.worker.ready()
        except (WorkerGone, HecbenchError) as error:
            if found := fault_of(stream.latest):
                raise DeviceFault(found[0], name, found[1]) from None
            raise recovery.explained(name, str(error)) from None
        try:
            offset = np.array(self.request("call", "getTCPOffset"))
        except HecbenchError:
            self.worker.end()
            raise
        self.flange_T_tcp: Array = se3.from_rotvec(offset[3:], offset[:3])
        stream.supervise(self._on_fault, self.worker.pulse.beat)

    @property
    def fault(self) -> DeviceFault | None:
        """Why nothing moves any more until control is taken anew."""
        return self._stream.fault or self._fault

    def _on_fault(self, fault: Fault) -> None:
        """Runs in the supervisor's thread too. A controller that stopped by itself needs no telling."""
        if fault in (Fault.FORCE, Fault.STALE, Fault.LINK_LOST):
            with suppress(DeviceFault):
                self._dashboard.ask("stop")

    def request(self, method: str, *args: object, deadline_s: float = CALL_S) -> Any:
        """One request to the worker; its death becomes the fault that caused it."""
        try:
            if self._stream.link_lost:
                self.worker.end()
                raise WorkerGone("the state stream is gone")
            return self.worker.request(method, *args, deadline_s=deadline_s)
        except WorkerGone as error:
            self._on_fault(Fault.LINK_LOST)
            self._fault = self._fault or recovery.explained(self._name, str(error))
            raise self._stream.fault or self._fault from None

    def run(
        self, name: str, target: list[float], speed: float, acceleration: float, expected_s: float
    ) -> None:
        """Carry out one motion; whatever ends it early brakes the arm.

        Raises:
            InputError: Another motion is under way.
            DeviceFault: It did not arrive, and why.
        """
        if not self._motion.acquire(blocking=False):
            raise InputError(f"{self._name} is moving already: stop it or wait")
        self._stopping.clear()
        first = self._stream.latest
        allowed_s = expected_s / max(first.speed_fraction, 0.01) + self._supervision.late_s
        try:
            before = self.request("start", name, target, speed, acceleration)
            if before is None:
                raise self.why_program_ended()
            while not self._has_ended(before) and not self._stopping.wait(POLL_S):
                if self._is_late(first, allowed_s):
                    raise DeviceFault(Fault.LATE, self._name, f"a motion of {expected_s:.1f} s does not end")
            if self._stopping.is_set():  # a motion that was braked has ended too, elsewhere
                raise DeviceFault(Fault.STOPPED, self._name, "stopped on request")
        except BaseException as error:
            if isinstance(error, DeviceFault) and error.fault is not Fault.STOPPED:
                self._fault = self._fault or error
            self.stop()
            raise
        finally:
            self._motion.release()

    def _is_late(self, first: Sample, allowed_s: float) -> bool:
        """By this computer's clock, or by a simulated controller's faster one after some patience."""
        here_s = time.monotonic() - first.arrived_s
        there_s = self._stream.latest.controller_s - first.controller_s
        return here_s > allowed_s or (there_s > allowed_s and here_s > self._supervision.late_s)

    def _has_ended(self, before: int) -> bool:
        operation, running, playing = self.request("progress")
        if self._stream.fault:
            raise self._stream.fault
        if not playing:
            raise self.why_program_ended()
        return bool(operation != before and not running)

    def why_program_ended(self) -> DeviceFault:
        """The reason for a control script that does not run."""
        if self.worker.pulse.abandoned:
            detail = f"no state was judged for {self._supervision.patience_s:.2f} s, the arm was braked"
            return DeviceFault(Fault.STALE, self._name, detail)
        self._stream.wait_for(lambda _: self._stream.fault is not None, _NEWS_S)
        if self._stream.fault:
            return self._stream.fault
        if not self._dashboard.is_remote():
            return DeviceFault(Fault.LOCAL_MODE, self._name, "the pendant took over")
        return DeviceFault(Fault.PROGRAM_ENDED, self._name, "the controller ended the control program")

    def stop(self) -> None:
        """Brake now, from any thread."""
        self._stopping.set()
        with suppress(DeviceFault):
            self.request("call", "stopJ", STOP_RAD_S2, deadline_s=_BRAKE_S)

    @contextmanager
    def freedrive(self) -> Iterator[None]:
        """The arm can be guided by hand inside the block."""
        if not self.request("call", "freedriveMode"):
            raise self.why_program_ended()
        try:
            yield
        except BaseException:
            with suppress(HecbenchError):
                self.request("call", "endFreedriveMode")
            raise
        if not self.request("call", "endFreedriveMode"):
            raise self.why_program_ended()

    def end(self) -> None:
        """End the worker at once; the controller's watchdog stops what still moves."""
        self.worker.end()

    def close(self) -> None:
        """Brake, end the control script, let go of the controller."""
        if self._stream.link_lost:
            self.end()
        else:
            self.worker.leave()
