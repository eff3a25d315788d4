"""A Robotiq 2F gripper behind the socket of its URCap: SET and GET lines, 0 open to 255 closed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

FULL_STROKE_S = 0.6
_MOVING, _HOLDING, _AT_TARGET = 0, 2, 3
_ACTIVE = 3
_AUTOMATIC_RELEASE_DONE = 15
_BYTE: Final = tuple(
    [
        "ACT",
        "GTO",
        "ATR",
        "ARD",
        "FOR",
        "SPE",
        "POS",
        "LBP",
        "LRD",
        "LBL",
        "LGN",
        "MSC",
        "MOD",
        "SID",
        "DEACT",
        "SCN_BLOCK",
    ]
)
"""What a client may set, each 0 to 255."""
_DIGITS: Final = {"FLT": 2, "PRE": 3, "POS": 3}
"""Width of a value in the answer to a GET without a newline, for readers of a fixed number of bytes."""
_SLAVE = 9
CONNECTED = f"[{_SLAVE}, 0, 0, 0]     "
"""Slave numbers of the grippers that the URCap found."""


@dataclass
class RobotiqSocket:
    """The gripper's registers, advanced once per cycle of the controller."""

    object_at: int | None = None
    """Position at which the fingers meet an object."""
    jammed: bool = False
    silent: bool = False
    registers: dict[str, int] = field(
        default_factory=lambda: {
            **dict.fromkeys(_BYTE, 0),
            **dict.fromkeys(("STA", "FLT", "PRE", "OBJ", "COU", "NCY"), 0),
            **dict.fromkeys(("POS", "PRE"), 3),
            **dict.fromkeys(("FOR", "SPE"), 255),
            "OBJ": _AT_TARGET,
            "SID": _SLAVE,
        }
    )
    _position: float = 3.0

    def answer(self, line: str) -> bytes:
        """Reply to one line; the acknowledgement of SET has no newline, as on the real one."""
        words = line.split()
        if self.silent or not words:
            return b""
        if words[0] == "GET" and len(words) == 2 and words[1] in self.registers:
            return f"{words[1]} {self.registers[words[1]]}\n".encode()
        if words[0] == "SET" and len(words) > 1 and len(words) % 2:
            return b"ack" if self._set(dict(zip(words[1::2], words[2::2], strict=True))) else b"?\n"
        return b"?\n"

    def answer_bare(self, text: str) -> bytes:
        """Reply to a request without a newline, as programs on the controller send it: the value alone."""
        if self.silent:
            return b""
        if text.strip() == "GET SID":
            return CONNECTED.encode()
        reply = self.answer(text)
        name, _, value = reply.decode().strip().partition(" ")
        return value.zfill(_DIGITS.get(name, 1)).encode() if value else reply

    def step(self, dt_s: float) -> None:
        """Move the fingers by one cycle."""
        registers = self.registers
        if registers["OBJ"] != _MOVING or not registers["GTO"] or not registers["ACT"] or self.jammed:
            return
        stride = 255 * dt_s / FULL_STROKE_S * max(registers["SPE"], 25) / 255
        target = registers["PRE"]
        blocked = self.object_at is not None and self._position <= self.object_at < target
        goal = self.object_at if blocked and self.object_at is not None else target
        self._position += min(max(goal - self._position, -stride), stride)
        registers["POS"] = round(self._position)
        if self._position == goal:
            registers["OBJ"] = _HOLDING if blocked else _AT_TARGET

    def _set(self, words: dict[str, str]) -> bool:
        """Take all of the values, or none when one is not a register's."""
        if not all(
            name in _BYTE and value.isdecimal() and int(value) <= 255 for name, value in words.items()
        ):
            return False
        registers = self.registers
        values = {name: int(value) for name, value in words.items()}
        if values.get("SID", _SLAVE) != _SLAVE:
            return False
        target = values.pop("POS", None)
        registers.update(values)
        if values.get("DEACT"):
            values["ACT"] = registers["ACT"] = 0
        if "ACT" in values:
            registers["STA"] = _ACTIVE if values["ACT"] else 0
        if values.get("ATR"):
            target, registers["FLT"] = 255 * registers["ARD"], _AUTOMATIC_RELEASE_DONE
        elif "ATR" in values or "ACT" in values:
            registers["FLT"] = 0
        if target is not None:
            registers["PRE"], registers["OBJ"] = min(target, 255), _MOVING
        return True
