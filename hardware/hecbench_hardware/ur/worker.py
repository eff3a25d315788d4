"""The processes in which ur_rtde lives: ``python -P worker.py control|outputs|receive HOST FD``.

Loads nothing of the project, so it starts in some tens of milliseconds. The client library can hang for ever
while it holds the interpreter, and it can abort the process; so every call of it runs under a timer of the
kernel whose default action ends this process, and the parent reads the end of the pipe as a lost link.
"""

from __future__ import annotations

import mmap
import os
import signal
import struct
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from typing import Any

CONNECT_S = 5.0
CALL_S = 1.0
LEAVE_S = 1.0
BEGIN_S = 0.02
"""An accepted motion shows in the status some cycles later."""
WATCHDOG_HZ = 2.0
"""The controller ends the program by itself when it hears nothing for half a second."""
TEND_S = 0.05
"""How often the watchdog is fed, or found unfit to be."""
MOTIONS = ("moveJ", "moveL")
"""What the parent can drive, and checks."""
CALLS = ("getTCPOffset", "stopJ", "freedriveMode", "endFreedriveMode")
STREAM_HZ = 125.0
STOP_RAD_S2 = 4.0
SAMPLE = struct.Struct("35d")
VARIABLES = [
    "timestamp",
    "actual_q",
    "actual_qd",
    "actual_TCP_pose",
    "actual_TCP_force",
    "robot_mode",
    "safety_mode",
    "runtime_state",
    "safety_status_bits",
    "robot_status_bits",
    "speed_scaling",
    "target_speed_fraction",
    "actual_digital_output_bits",
]


@contextmanager
def ends_after(seconds: float) -> Iterator[None]:
    """End this process unless the block does in time."""
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)


class Pulse:
    """Memory that parent and worker share: when the state arrived that was judged last, and whether that was too late.

    Both use the monotonic clock of one computer. Nothing here can block: a process that hangs leaves an old number.
    """

    _CELLS = struct.Struct("dd")
    SIZE = _CELLS.size

    def __init__(self, descriptor: int) -> None:
        """Of a file of `SIZE` bytes."""
        self._memory = mmap.mmap(descriptor, self.SIZE)

    def beat(self, arrived_s: float) -> None:
        """The parent has judged a state, and may go on."""
        struct.pack_into("d", self._memory, 0, arrived_s)

    def abandon(self) -> None:
        """The worker has stopped the arm because no state was judged."""
        struct.pack_into("d", self._memory, 8, 1.0)

    @property
    def age_s(self) -> float:
        """Of the state that was judged last."""
        return time.monotonic() - float(self._CELLS.unpack_from(self._memory)[0])

    @property
    def abandoned(self) -> bool:
        """Whether the worker has stopped the arm."""
        return bool(self._CELLS.unpack_from(self._memory)[1])


class Control:
    """The one client that may move the arm. Its methods are what the parent can ask for.

    While the arm is on its way, or free to be guided, the controller's watchdog is fed only as long as the parent
    judges states: when the last one is older than `patience_s`, the arm is braked and the script ended. At rest the
    parent may be busy with other things.
    """

    def __init__(self, host: str, pulse: Pulse, patience_s: float) -> None:
        """Connect and upload the control script."""
        import rtde_control

        self._pulse, self._patience_s = pulse, patience_s
        self._under_way = self._free = False
        self._before = 0
        self._interface = rtde_control.RTDEControlInterface(host)
        self._interface.setWatchdog(WATCHDOG_HZ)

    def call(self, name: str, *args: Any) -> Any:
        """A method of RTDEControlInterface that drives nothing."""
        if name not in CALLS:
            raise AttributeError(f"{name} is not one of {', '.join(CALLS)}")
        if name in ("freedriveMode", "endFreedriveMode"):
            self._free = name == "freedriveMode"
        if name == "stopJ":
            self._under_way = False
        return getattr(self._interface, name)(*args)

    def start(self, name: str, *args: Any) -> int | None:
        """Start an asynchronous motion; the number of the one before it, or None when it was not accepted."""
        if name not in MOTIONS:
            raise AttributeError(f"{name} is not one of {', '.join(MOTIONS)}")
        before = self._before = self.progress()[0]
        self._under_way = True
        if not getattr(self._interface, name)(*args, True):
            return None
        deadline = time.monotonic() + BEGIN_S
        while self.progress()[0] == before and time.monotonic() < deadline:
            time.sleep(BEGIN_S / 100)
        return before

    def progress(self) -> tuple[int, bool, bool]:
        """Number of the motion, whether it runs, and whether the control script does."""
        status = self._interface.getAsyncOperationProgressEx()
        operation, running = status.operationId(), status.isAsyncOperationRunning()
        if operation != self._before and not running:
            self._under_way = False
        return operation, running, self._interface.isProgramRunning()

    def tend(self) -> None:
        """Keep the controller's watchdog quiet, or stop an arm that nobody watches."""
        if self._pulse.abandoned:
            return
        if (self._under_way or self._free) and self._pulse.age_s > self._patience_s:
            self._pulse.abandon()
            self.leave()
        else:
            self._interface.kickWatchdog()

    def leave(self) -> None:
        """Brake and end the script."""
        if self._interface.isProgramRunning():
            self._interface.stopJ(STOP_RAD_S2)
            self._interface.stopScript()


class Outputs:
    """The client of digital outputs and the speed slider; it needs no script on the controller."""

    def __init__(self, host: str, pulse: Pulse, patience_s: float) -> None:
        """Connect."""
        import rtde_io

        self._interface = rtde_io.RTDEIOInterface(host)

    def call(self, name: str, *args: Any) -> Any:
        """A method of RTDEIOInterface."""
        return getattr(self._interface, name)(*args)

    def tend(self) -> None:
        """The controller does not watch this client."""

    def leave(self) -> None:
        """The outputs stay as they are."""


DONE, REFUSED, BROKEN = "done", "refused", "broken"
CLIENTS: dict[str, type[Control] | type[Outputs]] = {"control": Control, "outputs": Outputs}


def serve(
    role: str, host: str, connection: Connection, pulse: Pulse, patience_s: float, leniency: float
) -> Control | Outputs | None:
    """Answer requests ``(number, method, args, deadline_s)`` until the parent says None or is gone; then leave.

    Returns the client, so that its destructor does not run; None when it did not connect.
    """
    try:
        with ends_after(CONNECT_S * leniency):
            client = CLIENTS[role](host, pulse, patience_s)
    except RuntimeError as error:
        connection.send(str(error))
        return None
    connection.send(None)
    tended = time.monotonic()
    try:
        while True:
            if time.monotonic() - tended > TEND_S:
                with ends_after(CALL_S * leniency):
                    client.tend()
                tended = time.monotonic()
            if not connection.poll(TEND_S):
                continue
            request = connection.recv()
            if request is None:
                break
            number, *call = request
            connection.send((number, *_answer(client, *call)))
    except (EOFError, OSError):
        pass
    with ends_after(LEAVE_S * leniency):
        client.leave()
    return client


def _answer(
    client: Control | Outputs, name: str, args: tuple[Any, ...], deadline_s: float
) -> tuple[str, Any]:
    """What became of a call, and its result or the reason.

    ur_rtde raises a RuntimeError when a link breaks under a call ("End of file"); after that it is good for nothing.
    """
    try:
        with ends_after(deadline_s):
            return DONE, getattr(client, name)(*args)
    except (TypeError, AttributeError, ValueError, IndexError) as error:
        return REFUSED, str(error)
    except (RuntimeError, OSError) as error:
        return BROKEN, str(error)


def receive(host: str, connection: Connection, leniency: float) -> Any:
    """Send a packed sample `STREAM_HZ` times a second until the parent is gone; returns as `serve` does."""
    import rtde_receive

    try:
        with ends_after(CONNECT_S * leniency):
            client = rtde_receive.RTDEReceiveInterface(host, STREAM_HZ, VARIABLES)
    except RuntimeError as error:
        connection.send(str(error))
        return None
    connection.send(None)
    try:
        while True:
            connection.send_bytes(_sample(client))
            time.sleep(1 / STREAM_HZ)
    except OSError:
        return client


def _sample(client: Any) -> bytes:
    return SAMPLE.pack(
        time.monotonic(),
        client.getTimestamp(),
        client.isConnected(),
        client.getRobotMode(),
        client.getSafetyMode(),
        client.getSafetyStatusBits(),
        client.getRobotStatus(),
        client.getRuntimeState(),
        client.getSpeedScaling(),
        client.getTargetSpeedFraction(),
        client.getActualDigitalOutputBits(),
        *client.getActualQ(),
        *client.getActualQd(),
        *client.getActualTCPPose(),
        *client.getActualTCPForce(),
    )


def main(role: str, host: str, descriptor: str, shared: str, patience_s: str, leniency: str) -> None:
    """Serve one role; leave without the library's destructors, which wait, or abort when the link is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with Connection(int(descriptor)) as connection:
        if role == "receive":
            client = receive(host, connection, float(leniency))
        else:
            client = serve(role, host, connection, Pulse(int(shared)), float(patience_s), float(leniency))
        os._exit(client is None)


if __name__ == "__main__":
    main(*sys.argv[1:])
