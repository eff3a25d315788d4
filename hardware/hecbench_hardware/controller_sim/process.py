"""The simulated controller as a child process, with a line to its fault port."""

from __future__ import annotations

import selectors
import socket
import subprocess
import sys
from contextlib import suppress
from types import TracebackType
from typing import Self

from hecbench.errors import HecbenchError, InputError
from hecbench_hardware.controller_sim.server import FAULT_PORT, VERSION

_START_S = 30.0
_STOP_S = 5.0
_ANSWER_S = 5.0
_FIRST_FREE, _LAST_FREE = 100, 199
"""Last byte of the loopback addresses from which a free one is taken."""


class SimulatedController:
    """Starts a controller of its own in `with`, and ends it by its process id."""

    def __init__(
        self,
        host: str | None = None,
        *,
        model: str = "ur5e",
        time_scale: float = 1.0,
        version: tuple[int, int, int, int] = VERSION,
    ) -> None:
        """Without a host, the first free address of 127.0.0.100-199 is taken."""
        self.host = host or ""
        self._model, self._time_scale, self._version = model, time_scale, version
        self._process: subprocess.Popen[str] | None = None

    def start(self) -> Self:
        """Start it and wait until it listens.

        Raises:
            HecbenchError: It did not come up; the message is its own.
        """
        if self.host:
            self._start(self.host)
            return self
        for last in range(_FIRST_FREE, _LAST_FREE + 1):
            candidate = f"127.0.0.{last}"
            if not _is_free(candidate):
                continue
            try:
                self._start(candidate)
            except InputError:  # another process took the address in between
                continue
            self.host = candidate
            return self
        raise HecbenchError("no free loopback address for a simulated controller: end some of those running")

    def _start(self, host: str) -> None:
        version = ".".join(str(part) for part in self._version)
        command = [sys.executable, "-P", "-m", "hecbench_hardware.controller_sim"]
        self._process = subprocess.Popen(
            [*command, host, self._model, str(self._time_scale), version],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        line = _first_line(self._process)
        if line != f"ready {host}":
            code = self._ended() if line else self.stop()
            message = line or f"the simulated controller at {host} ended with code {code} before it was ready"
            raise InputError(message) if code == InputError.exit_code else HecbenchError(message)

    def fault(self, line: str) -> None:
        """Send one verb of `controller_sim.faults`; a wrong one raises `InputError`."""
        answer = self.ask(line)
        if answer != "ok":
            raise InputError(answer)

    def ask(self, line: str) -> str:
        """The answer of the fault port to one line, `log` or `speed`."""
        with socket.create_connection((self.host, FAULT_PORT), timeout=_ANSWER_S) as client:
            client.sendall(f"{line}\n".encode())
            return client.makefile().readline().strip()

    def _ended(self) -> int:
        """The exit code of a process that is about to end by itself."""
        assert self._process
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_STOP_S)
        return self.stop()

    def stop(self) -> int:
        """End the process and return its exit code; harmless when it has ended."""
        if self._process is None:
            return 0
        process, self._process = self._process, None
        process.terminate()
        try:
            return process.wait(_STOP_S)
        except subprocess.TimeoutExpired:
            process.kill()
            return process.wait()
        finally:
            for stream in (process.stdin, process.stdout):
                if stream:
                    stream.close()

    def __enter__(self) -> Self:
        """Start."""
        return self.start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop."""
        self.stop()


def _is_free(host: str) -> bool:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, FAULT_PORT))
        except OSError:
            return False
    return True


def _first_line(process: subprocess.Popen[str]) -> str:
    assert process.stdout
    with selectors.DefaultSelector() as selector:
        selector.register(process.stdout, selectors.EVENT_READ)
        return process.stdout.readline().strip() if selector.select(_START_S) else ""
