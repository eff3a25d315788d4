"""Numbers and lists."""

from __future__ import annotations

import math
import random as randomness
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from hecbench_hardware.controller_sim.arm import ScriptError
from hecbench_hardware.controller_sim.urscript.functions import Builtin, builtins
from hecbench_hardware.controller_sim.urscript.machine import Machine
from hecbench_hardware.controller_sim.urscript.values import LIST_ITEMS, Value, is_number, number, vector

_LONGEST_BITS = 64


def _of_one(name: str, function: Callable[[float], float]) -> Builtin:
    def call(_: Machine, x: Value) -> float:
        return function(number(x))

    return Builtin(name, call, (("x", Builtin.REQUIRED),))


def norm(_: Machine, a: Value) -> float:
    """The absolute value of a number, the length of a list."""
    return abs(a) if is_number(a) else math.hypot(*vector(a, len(a), "the list"))


def atan2(_: Machine, x: Value, y: Value) -> float:
    """The angle of a point, first argument over second."""
    return math.atan2(number(x), number(y))


def pow_(_: Machine, base: Value, exponent: Value) -> float:
    """A power."""
    return math.pow(number(base), number(exponent))


def log(_: Machine, b: Value, f: Value) -> float:
    """The logarithm of f to base b."""
    return math.log(number(f), number(b))


def random(_: Machine) -> float:
    """Uniform in [0, 1)."""
    return randomness.random()


def get_list_length(_: Machine, v: Value) -> int:
    """Items of a list, characters of a text."""
    return len(v)


def make_list(_: Machine, length: Value, initial_value: Value, capacity: Value = None) -> list[Value]:
    """A list of equal items; the capacity is not needed here."""
    if not 0 <= length <= LIST_ITEMS:
        raise ScriptError(f"a list has 0 to {LIST_ITEMS} items")
    return [initial_value] * int(length)


def size(_: Machine, v: Value) -> Value:
    """Items of a list; rows and columns of a matrix."""
    return [len(v), len(v[0])] if v and isinstance(v[0], list) else len(v)


def normalize(_: Machine, v: Value) -> list[float]:
    """A list of length 1."""
    values = vector(v, len(v), "the list")
    result: list[float] = (values / np.linalg.norm(values)).tolist() if values.any() else values.tolist()
    return result


def transpose(_: Machine, m: Value) -> list[list[float]]:
    """A matrix with rows and columns exchanged."""
    return [list(row) for row in zip(*m, strict=True)]


def integer_to_binary_list(_: Machine, x: Value) -> list[bool]:
    """The 32 bits of a number, the lowest first."""
    return [bool(int(x) >> i & 1) for i in range(32)]


def binary_list_to_integer(_: Machine, bits: Value) -> int:
    """The number of a list of bits, the lowest first."""
    if len(bits) > _LONGEST_BITS:
        raise ScriptError(f"more than {_LONGEST_BITS} bits")
    return sum(1 << i for i, bit in enumerate(bits) if bit)


_ONE_NUMBER: Final[dict[str, Callable[[float], Any]]] = {
    "acos": math.acos,
    "asin": math.asin,
    "atan": math.atan,
    "cos": math.cos,
    "sin": math.sin,
    "tan": math.tan,
    "sqrt": math.sqrt,
    "ceil": math.ceil,
    "floor": math.floor,
    "d2r": math.radians,
    "r2d": math.degrees,
}

FUNCTIONS: Final = {
    **{name: _of_one(name, function) for name, function in _ONE_NUMBER.items()},
    **builtins(
        norm,
        atan2,
        pow_,
        log,
        random,
        get_list_length,
        make_list,
        size,
        normalize,
        transpose,
        integer_to_binary_list,
        binary_list_to_integer,
    ),
    "length": Builtin("length", get_list_length, (("v", Builtin.REQUIRED),)),
}
