"""A worker process and the pipe to it, with a deadline on everything."""

from __future__ import annotations

import socket
import subprocess
import sys
import tempfile
import threading
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from hecbench.errors import HecbenchError
from hecbench_hardware.ur import worker

_START_S = 5.0
_GRACE_S = 0.2
"""How much longer than the worker's own deadline the parent waits before it ends the worker."""


class WorkerGone(Exception):
    """The worker ended or did not answer in time; it is certainly ended now."""


class Worker:
    """One worker process. Its death is noticed at the next use, and `end` always leaves none behind."""

    def __init__(self, role: str, host: str, *, patience_s: float = 0.0, leniency: float = 1.0) -> None:
        """Start the process; `ready` must follow. `patience_s` and `leniency` are those of the supervision."""
        self._leniency = leniency
        ours, theirs = socket.socketpair()
        with theirs, tempfile.TemporaryFile() as shared:
            shared.truncate(worker.Pulse.SIZE)
            self.pulse = worker.Pulse(shared.fileno())
            descriptors = [theirs.fileno(), shared.fileno()]
            command = [sys.executable, "-P", str(Path(worker.__file__)), role, host]
            self._process = subprocess.Popen(
                [*command, *map(str, descriptors), str(patience_s), str(leniency)],
                pass_fds=descriptors,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
        self.connection = Connection(ours.detach())
        self._lock = threading.Lock()
        self._number = 0

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self._process.poll() is None

    def ready(self) -> None:
        """Wait until the client is connected.

        Raises:
            WorkerGone: It did not connect in time.
            HecbenchError: It was refused, in its own words.
        """
        try:
            if not self.connection.poll((_START_S + worker.CONNECT_S) * self._leniency):
                raise EOFError
            refusal = self.connection.recv()
        except (EOFError, OSError):
            self.end()
            raise WorkerGone("the client did not connect") from None
        if refusal:
            self.end()
            raise HecbenchError(refusal)

    def request(self, name: str, *args: object, deadline_s: float = worker.CALL_S) -> Any:
        """Ask for one method and wait for its result, at most `deadline_s` times the leniency and a little.

        Raises:
            WorkerGone: The worker ended, did not answer, or lost its link, and was ended.
            HecbenchError: There is no such call, or not with these arguments.
        """
        deadline_s *= self._leniency
        with self._lock:
            self._number += 1
            try:
                self.connection.send((self._number, name, args, deadline_s))
                number = -1
                while number != self._number:  # an interrupted request leaves its answer behind
                    if not self.connection.poll(deadline_s + _GRACE_S):
                        raise EOFError
                    number, outcome, result = self.connection.recv()
            except (EOFError, OSError):
                self.end()
                raise WorkerGone(f"{' '.join([name, *map(str, args[:1])])} had no answer") from None
        if outcome == worker.BROKEN:
            self.end()
            raise WorkerGone(f"{name}: {' '.join(result.split())}")
        if outcome == worker.REFUSED:
            raise HecbenchError(str(result))
        return result

    def leave(self) -> None:
        """Let the worker stop the arm and go; ends it when it does not."""
        try:
            self.connection.send(None)
            self._process.wait(worker.LEAVE_S * self._leniency + _GRACE_S)
        except (OSError, subprocess.TimeoutExpired):
            pass
        self.end()

    def kill(self) -> None:
        """End the process at once; the pipe stays, at its end."""
        self._process.kill()
        self._process.wait()

    def end(self) -> None:
        """End the process at once, and the pipe."""
        self.kill()
        self.connection.close()
