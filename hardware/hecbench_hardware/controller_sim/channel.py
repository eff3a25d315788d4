"""What a port of the simulated controller does with one connection."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

LINE_BYTES = 65536
"""A longer line is not a line."""


class Refused(Exception):
    """What the client sent is not of the port's protocol: its connection is closed."""


class Finished(Exception):
    """The conversation is over; the bytes are the last answer."""

    def __init__(self, last: bytes) -> None:
        super().__init__()
        self.last = last


class Channel(Protocol):
    """One client on one port."""

    def opened(self) -> bytes:
        """What the controller says first."""

    def receive(self, data: bytes) -> bytes:
        """The answers to what arrived, in pieces of any size; raises `Refused` or `Finished`."""

    def stream(self, now_s: float) -> bytes:
        """What the controller sends unasked in this cycle; `now_s` by the monotonic clock."""

    def close(self) -> None:
        """The client is gone."""


@dataclass
class LineChannel:
    """A line in, its answer out."""

    answer: Callable[[str], bytes]
    greeting: bytes = b""
    _inbox: bytes = b""

    def opened(self) -> bytes:
        """The greeting."""
        return self.greeting

    def receive(self, data: bytes) -> bytes:
        """Answer every complete line."""
        lines, self._inbox = complete_lines(self._inbox + data)
        return b"".join(self.answer(line) for line in lines)

    def stream(self, now_s: float) -> bytes:
        """Nothing unasked."""
        return b""

    def close(self) -> None:
        """Nothing to give up."""


def complete_lines(buffer: bytes) -> tuple[list[str], bytes]:
    """The complete lines in a buffer, and the rest; raises `Refused` when the rest is no line any more."""
    *lines, rest = buffer.split(b"\n")
    if len(rest) > LINE_BYTES:
        raise Refused(f"a line of more than {LINE_BYTES} bytes")
    return [line.decode(errors="replace") for line in lines], rest
