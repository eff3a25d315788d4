"""A Robotiq 2F gripper behind the socket of its URCap: SET and GET lines, 0 open to 255 closed."""

from __future__ import annotations

from dataclasses import dataclass, field

FULL_STROKE_S = 0.6
_MOVING, _HOLDING, _AT_TARGET = 0, 2, 3
_ACTIVE = 3


@dataclass
class RobotiqSocket:
    """The gripper's registers, advanced once per cycle of the controller."""

    object_at: int | None = None
    """Position at which the fingers meet an object."""
    jammed: bool = False
    silent: bool = False
    registers: dict[str, int] = field(
        default_factory=lambda: {
            **dict.fromkeys(("ACT", "GTO", "STA", "FLT"), 0),
            **dict.fromkeys(("POS", "PRE"), 3),
            **dict.fromkeys(("FOR", "SPE"), 255),
            "OBJ": _AT_TARGET,
        }
    )
    _position: float = 3.0

    def answer(self, line: str) -> bytes:
        """Reply to one line; the acknowledgement of SET has no newline, as on the real one."""
        words = line.split()
        if self.silent or not words:
            return b""
        if words[0] == "GET":
            return f"{words[1]} {self.registers.get(words[1], 0)}\n".encode()
        if words[0] != "SET":
            return b"?\n"
        for name, value in zip(words[1::2], words[2::2], strict=False):
            if name == "POS":
                self.registers["PRE"], self.registers["OBJ"] = int(value), _MOVING
            else:
                self.registers[name] = int(value)
        if "ACT" in words:
            self.registers["STA"] = _ACTIVE if self.registers["ACT"] else 0
        return b"ack"

    def step(self, dt_s: float) -> None:
        """Move the fingers by one cycle."""
        registers = self.registers
        if registers["OBJ"] != _MOVING or not registers["GTO"] or self.jammed:
            return
        stride = 255 * dt_s / FULL_STROKE_S * max(registers["SPE"], 25) / 255
        target = registers["PRE"]
        blocked = self.object_at is not None and self._position <= self.object_at < target
        goal = self.object_at if blocked and self.object_at is not None else target
        self._position += min(max(goal - self._position, -stride), stride)
        registers["POS"] = round(self._position)
        if self._position == goal:
            registers["OBJ"] = _HOLDING if blocked else _AT_TARGET
