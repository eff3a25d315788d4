"""One RTDE connection of the simulated controller: recipes, inputs, text messages and the stream of outputs."""

from __future__ import annotations

import struct
from collections.abc import MutableMapping, Sequence
from dataclasses import dataclass, field
from math import isfinite

from hecbench_hardware.controller_sim.channel import Refused
from hecbench_hardware.controller_sim.inputs_outputs import BANKS
from hecbench_hardware.controller_sim.outputs import READERS
from hecbench_hardware.controller_sim.program import CYCLE_S, ProgramRunner
from hecbench_hardware.controller_sim.signals import FORMATS, INPUTS, OUTPUTS, WIDTHS

_VERSION, _CONTROLLER_VERSION, _OUTPUTS, _INPUTS = b"VvOI"
_START, _PAUSE, _DATA, _TEXT = b"SPUM"
_HEADER = struct.Struct(">HB")
_WARNING = 2
_FASTEST_HZ, _VERSION_1_HZ = 500.0, 125.0
_RECIPE_BYTES = 16384
"""Eight times the guide's limit, so that one recipe can hold every output."""
_RECIPES = 255


@dataclass
class RtdeSession:
    """The state of one client: what it wants to hear, what it may write. Protocol 1 until it asks for 2."""

    program: ProgramRunner
    version: tuple[int, int, int, int]
    owners: MutableMapping[str, RtdeSession]
    """Which session may write an input; shared by all sessions of a controller."""
    protocol: int = 1
    streaming: bool = False
    period_s: float = 1 / _VERSION_1_HZ
    next_s: float = 0.0
    _inbox: bytes = b""
    _names: list[str] = field(default_factory=list)
    _layout: struct.Struct = field(default_factory=lambda: struct.Struct(">"))
    _recipes: list[tuple[list[str], struct.Struct]] = field(default_factory=list)

    def opened(self) -> bytes:
        """The server says nothing first."""
        return b""

    def receive(self, data: bytes) -> bytes:
        """Answer every complete frame; raises `Refused` for what is none."""
        buffer, self._inbox = self._inbox + data, b""
        replies = []
        while len(buffer) >= _HEADER.size:
            size, kind = _HEADER.unpack_from(buffer)
            if size < _HEADER.size:
                raise Refused(f"an RTDE frame of length {size}")
            if len(buffer) < size:
                break
            body, buffer = buffer[_HEADER.size : size], buffer[size:]
            replies.append(self._answer(kind, body))
        self._inbox = buffer
        return b"".join(replies)

    def stream(self, now_s: float) -> bytes:
        """The data frame that is due, if one is."""
        if not self.streaming or now_s < self.next_s - CYCLE_S / 4:
            return b""
        self.next_s = max(self.next_s + self.period_s, now_s)
        numbers: list[float] = [1] if self.protocol == 2 else []
        for name in self._names:
            value = READERS[name](self.program)
            if isinstance(value, int | float):
                numbers.append(value)
            else:
                numbers += value
        return frame(_DATA, self._layout.pack(*numbers))

    def close(self) -> None:
        """Give up the inputs that this client wrote."""
        for name in [name for name, owner in self.owners.items() if owner is self]:
            del self.owners[name]

    def text(self, message: str) -> bytes:
        """A warning to this client, at most 255 bytes."""
        content, source = message.encode()[:255], b"hecbench"
        if self.protocol == 1:
            return frame(_TEXT, bytes([_WARNING]) + content)
        return frame(
            _TEXT, bytes([len(content)]) + content + bytes([len(source)]) + source + bytes([_WARNING])
        )

    def _answer(self, kind: int, body: bytes) -> bytes:
        if kind == _DATA:
            complaint = self._write_inputs(body)
            return self._warn(complaint) if complaint else b""
        if kind == _TEXT:
            self.program.arm.note(f"RTDE text message: {body.decode(errors='replace')!r}")
            return b""
        if kind == _VERSION:
            return frame(kind, bytes([self._negotiate(body)]))
        if kind == _CONTROLLER_VERSION:
            return frame(kind, struct.pack(">4I", *self.version))
        if kind == _OUTPUTS:
            return frame(kind, self._set_outputs(body))
        if kind == _INPUTS:
            return frame(kind, self._add_inputs(body))
        if kind == _START:
            self.streaming = bool(self._names)
            return frame(kind, bytes([self.streaming]))
        if kind == _PAUSE:
            self.streaming = False
            return frame(kind, b"\x01")
        complaint = f"RTDE frame of unknown type {kind}"
        self.program.arm.note(complaint)
        return self.text(complaint)

    def _warn(self, complaint: str) -> bytes:
        """Note it, and say it to the client unless it waits for the answer to a set-up request."""
        self.program.arm.note(complaint)
        return self.text(complaint) if self.streaming else b""

    def _negotiate(self, body: bytes) -> bool:
        asked = int.from_bytes(body, "big") if len(body) == 2 else 0
        if asked in (1, 2):
            self.protocol = asked
        return asked in (1, 2)

    def _set_outputs(self, body: bytes) -> bytes:
        frequency = _VERSION_1_HZ
        if self.protocol == 2:
            if len(body) < 8:
                raise Refused("an output recipe without its frequency")
            (frequency,), body = struct.unpack_from(">d", body), body[8:]
        names = _names_of(body)
        types = [OUTPUTS.get(name, "NOT_FOUND") for name in names]
        known = bool(names) and "NOT_FOUND" not in types
        if known:
            self._names, self._layout = names, _layout(types, prefix="B" if self.protocol == 2 else "")
            hertz = frequency if isfinite(frequency) else _FASTEST_HZ
            self.period_s = 1 / min(max(hertz, 1.0), _FASTEST_HZ)
        return bytes([known]) + ",".join(types).encode()

    def _add_inputs(self, body: bytes) -> bytes:
        names = _names_of(body)
        types = [
            "IN_USE" if self.owners.get(name, self) is not self else INPUTS.get(name, "NOT_FOUND")
            for name in names
        ]
        identifier = 0
        if names and not {"NOT_FOUND", "IN_USE"} & set(types) and len(self._recipes) < _RECIPES:
            self.owners.update(dict.fromkeys(names, self))
            self._recipes.append((names, _layout(types)))
            identifier = len(self._recipes)
        return bytes([identifier]) + ",".join(types).encode()

    def _write_inputs(self, body: bytes) -> str:
        """Take the inputs of one data frame, or the complaint about it; a longer one than its recipe is cut."""
        identifier = body[0] if body else 0
        if not 1 <= identifier <= len(self._recipes):
            return f"input recipe {identifier} does not exist"
        names, layout = self._recipes[identifier - 1]
        complaint = ""
        if len(body) - 1 != layout.size:
            complaint = f"input recipe {identifier}: {len(body) - 1} bytes, expected {layout.size}"
            if len(body) - 1 < layout.size:
                return complaint
        numbers = iter(layout.unpack_from(body, 1))
        self._apply({name: [next(numbers) for _ in range(WIDTHS[INPUTS[name]])] for name in names})
        return complaint

    def _apply(self, values: dict[str, list[float]]) -> None:
        arm, program = self.program.arm, self.program
        for name in values:
            program.input_written_s[name] = program.wall_s
            if name.startswith("input_"):
                arm.io.inputs.write(name, values[name][0])
        first = {name: value[0] for name, value in values.items()}
        for bank in BANKS:
            mask = int(first.get(f"{bank}_digital_output_mask", 0))
            arm.io.set_digital_outputs(bank, mask, int(first.get(f"{bank}_digital_output", 0)))
        analog_mask = int(first.get("standard_analog_output_mask", 0))
        for port in (0, 1):
            fraction = first.get(f"standard_analog_output_{port}", arm.io.analog_outputs[port])
            if analog_mask >> port & 1 and isfinite(fraction):
                domain = int(first.get("standard_analog_output_type", 0)) >> port & 1
                arm.io.set_analog_output(port, fraction, domain)
        fraction = first.get("speed_slider_fraction", arm.speed_slider)
        if first.get("speed_slider_mask") and isfinite(fraction):
            arm.speed_slider = min(max(fraction, 0.01), 1.0)
        if "external_force_torque" in values:
            arm.external_wrench = values["external_force_torque"]


def frame(kind: int, body: bytes) -> bytes:
    """One RTDE frame."""
    return _HEADER.pack(_HEADER.size + len(body), kind) + body


def _names_of(body: bytes) -> list[str]:
    if len(body) > _RECIPE_BYTES:
        raise Refused(f"a recipe of {len(body)} bytes, the limit is {_RECIPE_BYTES}")
    return [name for name in body.decode(errors="replace").split(",") if name]


def _layout(types: Sequence[str], prefix: str = "") -> struct.Struct:
    return struct.Struct(">" + prefix + "".join(FORMATS[name] for name in types))
