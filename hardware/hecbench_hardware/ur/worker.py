"""The processes in which ur_rtde lives: ``python -P worker.py control|outputs|receive HOST FD``.

Loads nothing of the project, so it starts in some tens of milliseconds. The client library can hang for ever
while it holds the interpreter, and it can abort the process; so every call of it runs under a timer of the
kernel whose default action ends this process, and the parent reads the end of the pipe as a lost link.
"""

from __future__ import annotations

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
KICK_S = 0.15
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


class Control:
    """The one client that may move the arm. Its methods are what the parent can ask for."""

    def __init__(self, host: str) -> None:
        """Connect and upload the control script."""
        import rtde_control

        self._interface = rtde_control.RTDEControlInterface(host)
        self._interface.setWatchdog(WATCHDOG_HZ)

    def call(self, name: str, *args: Any) -> Any:
        """A method of RTDEControlInterface."""
        return getattr(self._interface, name)(*args)

    def start(self, name: str, *args: Any) -> int | None:
        """Start an asynchronous motion; the number of the one before it, or None when it was not accepted."""
        before = self.progress()[0]
        if not getattr(self._interface, name)(*args, True):
            return None
        deadline = time.monotonic() + BEGIN_S
        while self.progress()[0] == before and time.monotonic() < deadline:
            time.sleep(BEGIN_S / 100)
        return before

    def progress(self) -> tuple[int, bool, bool]:
        """Number of the motion, whether it runs, and whether the control script does."""
        status = self._interface.getAsyncOperationProgressEx()
        return status.operationId(), status.isAsyncOperationRunning(), self._interface.isProgramRunning()

    def kick(self) -> None:
        """Keep the controller's watchdog quiet."""
        self._interface.kickWatchdog()

    def leave(self) -> None:
        """Brake and end the script."""
        if self._interface.isProgramRunning():
            self._interface.stopJ(STOP_RAD_S2)
            self._interface.stopScript()


class Outputs:
    """The client of digital outputs and the speed slider; it needs no script on the controller."""

    def __init__(self, host: str) -> None:
        """Connect."""
        import rtde_io

        self._interface = rtde_io.RTDEIOInterface(host)

    def call(self, name: str, *args: Any) -> Any:
        """A method of RTDEIOInterface."""
        return getattr(self._interface, name)(*args)

    def kick(self) -> None:
        """The controller does not watch this client."""

    def leave(self) -> None:
        """The outputs stay as they are."""


CLIENTS: dict[str, type[Control] | type[Outputs]] = {"control": Control, "outputs": Outputs}


def serve(role: str, host: str, connection: Connection) -> Control | Outputs | None:
    """Answer requests ``(number, method, args, deadline_s)`` until the parent says None or is gone; then leave.

    Returns the client, so that its destructor does not run; None when it did not connect.
    """
    try:
        with ends_after(CONNECT_S):
            client = CLIENTS[role](host)
    except RuntimeError as error:
        connection.send(str(error))
        return None
    connection.send(None)
    kicked = time.monotonic()
    try:
        while True:
            if time.monotonic() - kicked > KICK_S:
                with ends_after(CALL_S):
                    client.kick()
                kicked = time.monotonic()
            if not connection.poll(KICK_S):
                continue
            request = connection.recv()
            if request is None:
                break
            number, *call = request
            connection.send((number, *_answer(client, *call)))
    except (EOFError, OSError):
        pass
    with ends_after(LEAVE_S):
        client.leave()
    return client


def _answer(
    client: Control | Outputs, name: str, args: tuple[Any, ...], deadline_s: float
) -> tuple[bool, Any]:
    try:
        with ends_after(deadline_s):
            return True, getattr(client, name)(*args)
    except (RuntimeError, TypeError, AttributeError) as error:
        return False, str(error)


def receive(host: str, connection: Connection) -> Any:
    """Send a packed sample `STREAM_HZ` times a second until the parent is gone; returns as `serve` does."""
    import rtde_receive

    try:
        with ends_after(CONNECT_S):
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


def main(role: str, host: str, descriptor: str) -> None:
    """Serve one role; leave without the library's destructors, which wait, or abort when the link is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with Connection(int(descriptor)) as connection:
        client = receive(host, connection) if role == "receive" else serve(role, host, connection)
        os._exit(client is None)


if __name__ == "__main__":
    main(*sys.argv[1:])
