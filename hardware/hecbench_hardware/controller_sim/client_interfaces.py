"""The primary, secondary and real-time interfaces: scripts in, states and messages out.

Maker's "Client interfaces", tables of software 5.10 (state) and real-time 5.10 (1,220 bytes).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from hecbench_hardware.controller_sim.channel import Refused
from hecbench_hardware.controller_sim.program import CYCLE_S, ProgramRunner
from hecbench_hardware.controller_sim.realtime_state import realtime_state
from hecbench_hardware.controller_sim.robot_messages import version_message
from hecbench_hardware.controller_sim.robot_state import robot_state
from hecbench_hardware.controller_sim.urscript.uploads import Uploads

SCRIPT_PORTS: Final = (30001, 30002, 30003, 30011, 30012, 30013)
_PRIMARY: Final = (30001, 30011)
_REALTIME: Final = (30003, 30013)
_READ_ONLY: Final = (30011, 30012, 30013)
_STATE_S = 0.1
Encoder = Callable[[ProgramRunner, tuple[int, ...]], bytes]
_REALTIME_S, _OLD_REALTIME_S = 0.002, 0.008
"""The e-Series sends 500 states a second, the CB series 125."""
_FIRST_E_SERIES = 5
_UPLOAD_BYTES = 1 << 20


@dataclass
class ClientInterfaces:
    """Makes the conversations of these ports, and encodes each cycle's states once for all of them."""

    program: ProgramRunner
    version: tuple[int, int, int, int]
    _encoded: dict[Encoder, tuple[int, bytes]] = field(default_factory=dict)

    def channel(self, port: int) -> ScriptChannel:
        """A conversation for a new client."""
        return ScriptChannel(self, port)

    def encoded(self, encode: Encoder) -> bytes:
        """The state of this cycle."""
        cycle, content = self._encoded.get(encode, (-1, b""))
        if cycle != self.program.cycle:
            content = encode(self.program, self.version)
            self._encoded[encode] = (self.program.cycle, content)
        return content


@dataclass
class ScriptChannel:
    """One client of a script port."""

    interfaces: ClientInterfaces
    port: int
    _next_s: float = 0.0
    _seen: int = 0

    def __post_init__(self) -> None:
        self._program = self.interfaces.program
        self._uploads = Uploads(self._program)
        self._seen = self._program.messages.count
        old = self.interfaces.version[0] < _FIRST_E_SERIES
        realtime_s = _OLD_REALTIME_S if old else _REALTIME_S
        self._period_s = realtime_s if self.port in _REALTIME else _STATE_S

    def opened(self) -> bytes:
        """The version, except on the real-time interface."""
        return b"" if self.port in _REALTIME else version_message(self.interfaces.version)

    def receive(self, data: bytes) -> bytes:
        """Run the programs that are complete."""
        if self.port in _READ_ONLY:
            self._program.arm.note(f"port {self.port} is read-only: {len(data)} bytes ignored")
            return b""
        self._uploads.receive(data)
        if self._uploads.pending_bytes > _UPLOAD_BYTES:
            raise Refused(f"a program of more than {_UPLOAD_BYTES} bytes")
        return b""

    def stream(self, now_s: float) -> bytes:
        """The state when it is due, and new messages."""
        content = b""
        if self.port in _PRIMARY and self._seen != self._program.messages.count:
            content = self._program.messages.since(self._seen)
            self._seen = self._program.messages.count
        if now_s >= self._next_s - CYCLE_S / 4:
            self._next_s = max(self._next_s + self._period_s, now_s)
            content += self.interfaces.encoded(realtime_state if self.port in _REALTIME else robot_state)
        return content

    def close(self) -> None:
        """Note what arrived without its end."""
        if rest := self._uploads.unfinished():
            self._program.arm.note(f"port {self.port}: the client left in the middle of '{rest}'")
