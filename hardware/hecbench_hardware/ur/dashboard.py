"""The dashboard of a UR controller: one connection per question, each with a timeout, from any thread."""

from __future__ import annotations

import socket
from dataclasses import dataclass

from hecbench.errors import InputError
from hecbench_hardware.devices import DeviceFault, Fault

PORT = 29999
RTDE_PORT = 30004
SIMULATED = "(hecbench simulated)"
"""Our simulated controller says this after its version; nothing else makes an arm count as simulated."""


@dataclass(frozen=True)
class Dashboard:
    """Questions and commands of the pendant."""

    host: str
    timeout_s: float = 1.0

    def ask(self, command: str) -> str:
        """The answer to one command; raises `DeviceFault` when there is none."""
        try:
            with socket.create_connection((self.host, PORT), self.timeout_s) as client:
                client.settimeout(self.timeout_s)
                with client.makefile("rw", newline="\n") as lines:
                    lines.readline()
                    lines.write(f"{command}\n")
                    lines.flush()
                    answer = lines.readline()
        except OSError as error:
            detail = f"the dashboard does not answer ({error.strerror or 'time-out'})"
            raise DeviceFault(Fault.LINK_LOST, f"robot {self.host}", detail) from None
        if not answer.endswith("\n"):
            raise DeviceFault(Fault.LINK_LOST, f"robot {self.host}", f"no answer to '{command}'")
        return answer.strip()

    def refuse_other_model(self, device: str, model: str) -> None:
        """Raise an `InputError` when another model is there."""
        answer = self.ask("get robot model").upper()
        if answer.rstrip("E") != model.upper().rstrip("E"):
            raise InputError(f"{device} is a {answer}, not a {model}: choose the right --robot")

    def is_simulated(self) -> bool:
        """Whether this is our simulated controller."""
        return self.ask("PolyscopeVersion").endswith(SIMULATED)

    def is_remote(self) -> bool:
        """Whether the pendant allows remote control."""
        return "true" in self.ask("is in remote control").lower()


def probe(host: str, timeout_s: float = 2.0) -> None:
    """Refuse an address without a controller, in one line, before the client library tries it."""
    try:
        socket.create_connection((host, RTDE_PORT), timeout_s).close()
    except OSError as error:
        reason = {ConnectionRefusedError: "nothing listens there", TimeoutError: "no answer"}.get(
            type(error), error.strerror or str(error)
        )
        raise DeviceFault(
            Fault.LINK_LOST, f"robot {host}", f"port {RTDE_PORT}: {reason}, is the address right"
        ) from None
