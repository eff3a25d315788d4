"""Terminals and general purpose registers of the simulated controller."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from hecbench_hardware.controller_sim.signals import BITS, REGISTERS

BANKS: Final = {"standard": (0, 8), "configurable": (8, 8), "tool": (16, 2)}
"""First bit and number of terminals of each bank of digital inputs and outputs."""
ANALOG_PORTS: Final = 4
"""Two of the cabinet, two of the tool."""
TOOL_VOLTAGES: Final = (0, 12, 24)
CURRENT_DOMAIN, VOLTAGE_DOMAIN = 0, 1


@dataclass
class Registers:
    """The general purpose registers of one direction."""

    bits: list[bool] = field(default_factory=lambda: [False] * BITS)
    ints: list[int] = field(default_factory=lambda: [0] * REGISTERS)
    doubles: list[float] = field(default_factory=lambda: [0.0] * REGISTERS)

    def word(self, first: int) -> int:
        """32 bit registers from `first` on, in one word."""
        return sum(1 << i for i, bit in enumerate(self.bits[first : first + 32]) if bit)

    def set_word(self, first: int, word: int) -> None:
        """Set 32 bit registers from `first` on."""
        self.bits[first : first + 32] = [bool(word >> i & 1) for i in range(32)]

    def write(self, name: str, value: float) -> None:
        """Set the register or the 32 bits that RTDE calls by this name."""
        kind, index = name.split("_register", 1)
        if index.startswith("s"):
            self.set_word(int(index[1:].split("_")[0]), int(value))
        elif kind.endswith("_bit"):
            self.bits[int(index[1:])] = bool(value)
        elif kind.endswith("_int"):
            self.ints[int(index[1:])] = int(value)
        else:
            self.doubles[int(index[1:])] = float(value)


@dataclass
class InputsOutputs:
    """What is wired to the controller; analog values are fractions of their domain's range, 0 to 1."""

    digital_inputs: int = 0
    digital_outputs: int = 0
    analog_inputs: list[float] = field(default_factory=lambda: [0.0] * ANALOG_PORTS)
    analog_input_domains: list[int] = field(default_factory=lambda: [VOLTAGE_DOMAIN] * ANALOG_PORTS)
    analog_outputs: list[float] = field(default_factory=lambda: [0.0] * 2)
    analog_output_domains: list[int] = field(default_factory=lambda: [CURRENT_DOMAIN] * 2)
    tool_voltage: int = 0
    inputs: Registers = field(default_factory=Registers)
    outputs: Registers = field(default_factory=Registers)

    def set_digital_outputs(self, bank: str, mask: int, values: int) -> None:
        """Set the outputs of a bank that the mask names."""
        first, count = BANKS[bank]
        mask &= (1 << count) - 1
        self.digital_outputs = self.digital_outputs & ~(mask << first) | (values & mask) << first

    def set_analog_output(self, port: int, fraction: float, domain: int | None = None) -> None:
        """Set one analog output, and its domain (0 current, 1 voltage) if given."""
        self.analog_outputs[port] = min(max(fraction, 0.0), 1.0)
        if domain is not None:
            self.analog_output_domains[port] = domain
