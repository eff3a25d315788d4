"""One RTDE connection of the simulated controller: recipes, inputs, and the stream of outputs."""

from __future__ import annotations

import struct
from collections.abc import Mapping, MutableMapping, Sequence
from dataclasses import dataclass, field

from hecbench_hardware.controller_sim.program import OUTPUT_SHIFT, ProgramRunner
from hecbench_hardware.controller_sim.signals import (
    FORMATS,
    INPUTS,
    OUTPUTS,
    REGISTERS,
    SAFETY_BITS,
    WIDTHS,
    RobotMode,
    RuntimeState,
)

Values = Mapping[str, float | Sequence[float]]

_VERSION, _CONTROLLER_VERSION, _OUTPUTS, _INPUTS = ord("V"), ord("v"), ord("O"), ord("I")
_START, _PAUSE, _DATA = ord("S"), ord("P"), ord("U")
_HEADER = struct.Struct(">HB")
_JOINT_RUNNING = 253


@dataclass
class RtdeSession:
    """The state of one client: what it wants to hear, what it may write."""

    owners: MutableMapping[str, RtdeSession]
    """Which session may write an input; shared by all sessions of a controller."""
    version: tuple[int, int, int, int]
    streaming: bool = False
    period_s: float = 0.002
    next_s: float = 0.0
    _names: list[str] = field(default_factory=list)
    _layout: struct.Struct = field(default_factory=lambda: struct.Struct(">B"))
    _recipes: list[tuple[list[str], struct.Struct]] = field(default_factory=list)

    def receive(self, buffer: bytes, program: ProgramRunner) -> tuple[bytes, bytes]:
        """Answer every complete frame in the buffer; returns the replies and the unread rest."""
        replies = b""
        while len(buffer) >= _HEADER.size:
            size, kind = _HEADER.unpack_from(buffer)
            if len(buffer) < size:
                break
            body, buffer = buffer[_HEADER.size : size], buffer[size:]
            if kind == _DATA:
                self._write_inputs(body, program)
            else:
                reply = self._answer(kind, body)
                replies += frame(kind, reply)
        return replies, buffer

    def close(self) -> None:
        """Give up the inputs that this client wrote."""
        for name in [name for name, owner in self.owners.items() if owner is self]:
            del self.owners[name]

    def packet(self, values: Values) -> bytes:
        """The data frame of this client's output recipe."""
        numbers: list[float] = []
        for name in self._names:
            value = values[name]
            if isinstance(value, float | int):
                numbers.append(value)
            else:
                numbers += value
        return frame(_DATA, self._layout.pack(1, *numbers))

    def _answer(self, kind: int, body: bytes) -> bytes:
        if kind == _VERSION:
            return bytes([body == b"\x00\x02"])
        if kind == _CONTROLLER_VERSION:
            return struct.pack(">4I", *self.version)
        if kind == _OUTPUTS:
            return self._set_outputs(body)
        if kind == _INPUTS:
            return self._add_inputs(body)
        if kind == _START:
            self.streaming = bool(self._names)
            return bytes([self.streaming])
        if kind == _PAUSE:
            self.streaming = False
        return b"\x01"

    def _set_outputs(self, body: bytes) -> bytes:
        (frequency,) = struct.unpack_from(">d", body)
        names = [name for name in body[8:].decode().split(",") if name]
        types = [OUTPUTS.get(name, "NOT_FOUND") for name in names]
        known = "NOT_FOUND" not in types
        if known:
            self._names, self._layout = names, _layout(types, prefix="B")
            self.period_s = 1 / min(max(frequency, 1.0), 500.0)
        return bytes([known]) + ",".join(types).encode()

    def _add_inputs(self, body: bytes) -> bytes:
        names = [name for name in body.decode().split(",") if name]
        types = [
            "IN_USE" if self.owners.get(name, self) is not self else INPUTS.get(name, "NOT_FOUND")
            for name in names
        ]
        identifier = 0
        if not {"NOT_FOUND", "IN_USE"} & set(types):
            self.owners.update(dict.fromkeys(names, self))
            self._recipes.append((names, _layout(types)))
            identifier = len(self._recipes)
        return bytes([identifier]) + ",".join(types).encode()

    def _write_inputs(self, body: bytes, program: ProgramRunner) -> None:
        """Take the inputs of one data frame; one of another length than its recipe is dropped and noted."""
        arm = program.arm
        identifier = body[0] if body else 0
        if not 1 <= identifier <= len(self._recipes):
            arm.note(f"input recipe {identifier} does not exist")
            return
        names, layout = self._recipes[identifier - 1]
        if len(body) - 1 != layout.size:
            arm.note(f"input recipe {identifier}: {len(body) - 1} bytes, expected {layout.size}")
            if len(body) - 1 < layout.size:
                return
        numbers = iter(layout.unpack_from(body, 1))
        program.last_input_s = program.wall_s
        named: dict[str, int] = {}
        for name in names:
            values = [next(numbers) for _ in range(WIDTHS[INPUTS[name]])]
            if name.startswith("input_int_register_"):
                arm.int_inputs[int(name.rpartition("_")[2])] = values[0]
            elif name.startswith("input_double_register_"):
                arm.double_inputs[int(name.rpartition("_")[2])] = values[0]
            else:
                named[name] = values[0]
        for bank, shift in OUTPUT_SHIFT.items():
            mask = named.get(f"{bank}_digital_output_mask", 0)
            value = named.get(f"{bank}_digital_output", 0) & mask
            arm.digital_outputs = arm.digital_outputs & ~(mask << shift) | value << shift
        if named.get("speed_slider_mask"):
            arm.speed_slider = min(max(named["speed_slider_fraction"], 0.01), 1.0)


def frame(kind: int, body: bytes) -> bytes:
    """One RTDE frame."""
    return _HEADER.pack(_HEADER.size + len(body), kind) + body


def _layout(types: Sequence[str], prefix: str = "") -> struct.Struct:
    return struct.Struct(">" + prefix + "".join(FORMATS[name] for name in types))


def output_values(program: ProgramRunner) -> Values:
    """Every output of the controller in this cycle. What the simulation does not have is constant."""
    arm = program.arm
    playing = program.runtime is RuntimeState.PLAYING
    pose, joints = arm.tcp_vector, arm.joints.tolist()
    speeds = arm.joint_speeds.tolist()
    return {
        **_CONSTANT,
        "timestamp": arm.time_s,
        "target_q": joints,
        "actual_q": joints,
        "target_qd": speeds,
        "actual_qd": speeds,
        "actual_TCP_pose": pose,
        "target_TCP_pose": pose,
        "actual_TCP_force": arm.wrench.tolist(),
        "actual_digital_output_bits": arm.digital_outputs,
        "robot_mode": arm.robot_mode,
        "safety_mode": arm.safety,
        "speed_scaling": arm.slowdown * arm.speed_slider if playing else 0.0,
        "target_speed_fraction": arm.speed_slider,
        "runtime_state": program.runtime,
        "robot_status_bits": int(arm.robot_mode >= RobotMode.IDLE) | playing << 1,
        "safety_status_bits": SAFETY_BITS[arm.safety],
        "payload": arm.payload_kg,
        "payload_cog": arm.payload_cog_m,
        **{name: arm.int_outputs[i] for i, name in enumerate(_INT_OUTPUTS)},
        **{name: arm.double_outputs[i] for i, name in enumerate(_DOUBLE_OUTPUTS)},
    }


_INT_OUTPUTS = [f"output_int_register_{i}" for i in range(REGISTERS)]
_DOUBLE_OUTPUTS = [f"output_double_register_{i}" for i in range(REGISTERS)]
_CONSTANT: Values = {
    **{name: 0 if WIDTHS[kind] == 1 else [0] * WIDTHS[kind] for name, kind in OUTPUTS.items()},
    "joint_mode": [_JOINT_RUNNING] * 6,
    "joint_temperatures": [30.0] * 6,
    "actual_main_voltage": 48.0,
    "actual_robot_voltage": 48.0,
}
