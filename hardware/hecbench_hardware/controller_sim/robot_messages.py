"""Messages of the controller to the clients of its primary interface (maker's "Client interfaces", 5.10)."""

from __future__ import annotations

import struct
from collections import deque
from dataclasses import dataclass, field

_ROBOT_MESSAGE = 20
_SOURCE = 100
_TEXT, _POPUP, _VERSION, _RUNTIME_EXCEPTION = 0, 2, 3, 10
_REQUEST_BOOLEAN = 1
_KEPT = 256


def _message(kind: int, time_s: float, body: bytes) -> bytes:
    head = struct.pack(">BQBB", _ROBOT_MESSAGE, int(time_s * 1e6), _SOURCE, kind)
    return struct.pack(">i", 4 + len(head) + len(body)) + head + body


def version_message(version: tuple[int, int, int, int]) -> bytes:
    """The first message on every primary and secondary connection."""
    name, date = b"URControl", b"01-01-2022, 00:00:00"
    return _message(_VERSION, 0.0, bytes([len(name)]) + name + struct.pack(">BBii", *version) + date)


@dataclass
class Messages:
    """What happened, numbered, so that every client gets each message once."""

    recent: deque[tuple[int, bytes]] = field(default_factory=lambda: deque(maxlen=_KEPT))
    count: int = 0

    def since(self, number: int) -> bytes:
        """Everything after the message of this number."""
        return b"".join(message for n, message in self.recent if n > number)

    def text(self, time_s: float, text: str) -> None:
        """What a program says with `textmsg`."""
        self._add(_message(_TEXT, time_s, text.encode()))

    def popup(
        self, time_s: float, text: str, title: str, *, warning: bool, error: bool, blocking: bool
    ) -> None:
        """A window on the pendant."""
        heading = title.encode()[:255]
        flags = struct.pack(">IB???B", 0, _REQUEST_BOOLEAN, warning, error, blocking, len(heading))
        self._add(_message(_POPUP, time_s, flags + heading + text.encode()))

    def program_error(self, time_s: float, line: int, column: int, text: str) -> None:
        """The end of a program by a fault of its own."""
        self._add(_message(_RUNTIME_EXCEPTION, time_s, struct.pack(">ii", line, column) + text.encode()))

    def _add(self, message: bytes) -> None:
        self.count += 1
        self.recent.append((self.count, message))
