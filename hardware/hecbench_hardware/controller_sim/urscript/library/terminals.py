"""Digital and analog terminals, and the registers that RTDE shares."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from hecbench_hardware.controller_sim.arm import ScriptError
from hecbench_hardware.controller_sim.inputs_outputs import BANKS, TOOL_VOLTAGES, Registers
from hecbench_hardware.controller_sim.signals import BITS, REGISTERS
from hecbench_hardware.controller_sim.urscript.functions import Builtin, builtins
from hecbench_hardware.controller_sim.urscript.machine import Machine
from hecbench_hardware.controller_sim.urscript.values import Value, number, truth, whole

_TOOL_PORT = 8
"""`set_digital_out` counts the tool's terminals from here."""


def _terminal(bank: str, n: Value, what: str = "n") -> int:
    count = BANKS[bank][1]
    return _whole(n, count, what)


def _whole(n: Value, count: int, what: str) -> int:
    if not 0 <= whole(n, what) < count:
        raise ScriptError(f"{what} must be a whole number from 0 to {count - 1}, not {n}")
    return int(n)


def _set_digital(m: Machine, bank: str, n: Value, b: Value) -> None:
    bit = 1 << _terminal(bank, n)
    m.arm.io.set_digital_outputs(bank, bit, bit if truth(b, "b") else 0)


def set_digital_out(m: Machine, n: Value, b: Value) -> None:
    """A standard output, or from 8 on one of the tool."""
    tool = number(n, "n") >= _TOOL_PORT
    _set_digital(m, "tool" if tool else "standard", n - _TOOL_PORT if tool else n, b)


def set_flag(m: Machine, n: Value, b: Value) -> None:
    """One of the 32 flags, here the first output bit registers."""
    m.arm.io.outputs.bits[_whole(n, 32, "n")] = truth(b, "b")


def get_flag(m: Machine, n: Value) -> bool:
    """The flag."""
    return m.arm.io.outputs.bits[_whole(n, 32, "n")]


def set_standard_analog_out(m: Machine, n: Value, f: Value) -> None:
    """A fraction of the range, 0 to 1."""
    m.arm.io.set_analog_output(_whole(n, 2, "n"), number(f, "f"))


def set_analog_outputdomain(m: Machine, port: Value, domain: Value) -> None:
    """0 current, 1 voltage."""
    m.arm.io.analog_output_domains[_whole(port, 2, "port")] = _whole(domain, 2, "domain")


def set_analog_inputrange(m: Machine, port: Value, range_: Value) -> None:
    """The range code of an input."""
    m.arm.io.analog_input_domains[_whole(port, 4, "port")] = _whole(range_, 5, "range")


def set_standard_analog_input_domain(m: Machine, port: Value, domain: Value) -> None:
    """0 current, 1 voltage."""
    m.arm.io.analog_input_domains[_whole(port, 2, "port")] = _whole(domain, 2, "domain")


def set_tool_analog_input_domain(m: Machine, port: Value, domain: Value) -> None:
    """0 current, 1 voltage."""
    m.arm.io.analog_input_domains[2 + _whole(port, 2, "port")] = _whole(domain, 2, "domain")


def get_digital_in(m: Machine, n: Value) -> bool:
    """A standard input, or from 8 on one of the tool."""
    first = _TOOL_PORT if number(n, "n") >= _TOOL_PORT else 0
    return _bit(m.arm.io.digital_inputs, "tool" if first else "standard", n - first)


def get_digital_out(m: Machine, n: Value) -> bool:
    """A standard output, or from 8 on one of the tool."""
    first = _TOOL_PORT if number(n, "n") >= _TOOL_PORT else 0
    return _bit(m.arm.io.digital_outputs, "tool" if first else "standard", n - first)


def _bit(bits: int, bank: str, n: Value) -> bool:
    return bool(bits >> BANKS[bank][0] + _terminal(bank, n) & 1)


def set_tool_voltage(m: Machine, voltage: Value) -> None:
    """0, 12 or 24 V."""
    if voltage not in TOOL_VOLTAGES:
        raise ScriptError(f"the tool's voltage is one of {TOOL_VOLTAGES}, not {voltage}")
    m.arm.io.tool_voltage = int(voltage)


def set_runstate_outputs(m: Machine, outputs: Value) -> None:
    """Outputs that follow the state of the program; only the empty list is simulated."""
    if outputs:
        raise ScriptError("run-state outputs are not simulated")


def _of_bank(name: str, bank: str, kind: str) -> Builtin:
    def read(m: Machine, n: Value) -> bool:
        return _bit(getattr(m.arm.io, f"digital_{kind}puts"), bank, n)

    return Builtin(name, read, (("n", Builtin.REQUIRED),))


def _set_of_bank(name: str, bank: str) -> Builtin:
    def write(m: Machine, n: Value, b: Value) -> None:
        _set_digital(m, bank, n, b)

    return Builtin(name, write, (("n", Builtin.REQUIRED), ("b", Builtin.REQUIRED)))


def _analog(name: str, kind: str, first: int) -> Builtin:
    def read(m: Machine, n: Value) -> float:
        values: list[float] = getattr(m.arm.io, f"analog_{kind}puts")
        return values[first + _whole(n, 2, "n")]

    return Builtin(name, read, (("n", Builtin.REQUIRED),))


def _int32(value: Value) -> int:
    if not -(1 << 31) <= number(value, "value") < 1 << 31:
        raise ScriptError(f"an integer register holds 32 bits, not {value}")
    return int(value)


_REGISTERS: Final[dict[str, tuple[str, int, Callable[[Value], Any]]]] = {
    "integer": ("ints", REGISTERS, _int32),
    "float": ("doubles", REGISTERS, lambda value: number(value, "value")),
    "boolean": ("bits", BITS, lambda value: truth(value, "value")),
}
"""Field of `Registers`, number and conversion, by the word in URScript's names."""


def _read_register(name: str, direction: str, kind: str) -> Builtin:
    field, count, _ = _REGISTERS[kind]

    def read(m: Machine, address: Value) -> Value:
        registers: Registers = getattr(m.arm.io, f"{direction}s")
        return getattr(registers, field)[_whole(address, count, "address")]

    return Builtin(name, read, (("address", Builtin.REQUIRED),))


def _write_register(name: str, kind: str) -> Builtin:
    field, count, convert = _REGISTERS[kind]

    def write(m: Machine, address: Value, value: Value) -> None:
        getattr(m.arm.io.outputs, field)[_whole(address, count, "address")] = convert(value)

    return Builtin(name, write, (("address", Builtin.REQUIRED), ("value", Builtin.REQUIRED)))


def _families() -> dict[str, Builtin]:
    found: dict[str, Builtin] = {}
    for bank in BANKS:
        found[f"set_{bank}_digital_out"] = _set_of_bank(f"set_{bank}_digital_out", bank)
        for kind in ("in", "out"):
            name = f"get_{bank}_digital_{kind}"
            found[name] = _of_bank(name, bank, kind)
    for kind in ("in", "out"):
        for prefix in ("get", "get_standard"):
            found[f"{prefix}_analog_{kind}"] = _analog(f"{prefix}_analog_{kind}", kind, 0)
    found["get_tool_analog_in"] = _analog("get_tool_analog_in", "in", 2)
    for kind in _REGISTERS:
        for direction in ("input", "output"):
            name = f"read_{direction}_{kind}_register"
            found[name] = _read_register(name, direction, kind)
        found[f"write_output_{kind}_register"] = _write_register(f"write_output_{kind}_register", kind)
    return found


FUNCTIONS: Final = {
    **_families(),
    **builtins(
        set_digital_out,
        get_digital_in,
        get_digital_out,
        set_standard_analog_input_domain,
        set_tool_analog_input_domain,
        set_flag,
        get_flag,
        set_standard_analog_out,
        set_analog_outputdomain,
        set_analog_inputrange,
        set_tool_voltage,
        set_runstate_outputs,
    ),
    "set_analog_out": Builtin(
        "set_analog_out", set_standard_analog_out, (("n", Builtin.REQUIRED), ("f", Builtin.REQUIRED))
    ),
}
