"""Values of URScript: numbers, truth values, texts, lists, poses, structs and threads."""

from __future__ import annotations

from collections.abc import Callable
from math import fmod, isfinite
from typing import Any, Final

import numpy as np

from hecbench.se3 import Array
from hecbench_hardware.controller_sim.arm import ScriptError
from hecbench_hardware.controller_sim.geometry import pose_of, vector_of

Value = Any
"""bool, int, float, str, list of values, `Pose`, dict (a struct), `None` (what a procedure returns) or a thread."""

TEXT_CHARACTERS, LIST_ITEMS = 1 << 14, 4096
"""The longest text, and the most items of a list with all lists in it."""
_EXACT_INT = 1 << 53


class Pose(list[float]):
    """Position and rotation vector, metres and radians."""

    @property
    def matrix(self) -> Array:
        """The transform (4, 4)."""
        require_finite_numbers(self, "a pose")
        return pose_of(np.array(self, float))

    @classmethod
    def of(cls, a_T_b: Array) -> Pose:
        """The pose of a transform (4, 4)."""
        return cls(vector_of(a_T_b).tolist())


def copied(value: Value) -> Value:
    """Lists and structs are values, not references."""
    if isinstance(value, Pose):
        return Pose(value)
    if isinstance(value, list):
        return [copied(item) for item in value]
    if isinstance(value, dict):
        return {name: copied(item) for name, item in value.items()}
    return value


def is_number(value: Value) -> bool:
    """Whether it is a number, which a truth value is not."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def number(value: Value, what: str = "it") -> float:
    """A number, or an error."""
    if not is_number(value):
        raise ScriptError(f"{what} must be a number, not {text_of(value)}")
    return float(value)


def require_finite_numbers(values: Value, what: str) -> None:
    """Refuse a list with anything but finite numbers in it."""
    if not all(is_number(value) and isfinite(value) for value in values):
        raise ScriptError(f"{what} needs finite numbers, not {text_of(list(values))}")


def vector(value: Value, count: int, what: str) -> Array:
    """A list or pose of finite numbers (count,)."""
    if not isinstance(value, list) or len(value) != count:
        raise ScriptError(f"{what} must be {count} numbers, not {text_of(value)}")
    require_finite_numbers(value, what)
    return np.array(value, float)


def pose(value: Value, what: str = "the pose") -> Array:
    """The transform (4, 4) of a pose."""
    if not isinstance(value, Pose):
        raise ScriptError(f"{what} must be a pose p[...], not {text_of(value)}")
    return value.matrix


def truth(value: Value, what: str = "a condition") -> bool:
    """A truth value, or an error."""
    if not isinstance(value, bool):
        raise ScriptError(f"{what} must be True or False, not {text_of(value)}")
    return value


def text(value: Value, what: str = "it") -> str:
    """A text, or an error."""
    if not isinstance(value, str):
        raise ScriptError(f"{what} must be a text, not {text_of(value)}")
    return value


def whole(value: Value, what: str = "it") -> int:
    """A whole number, or an error."""
    if not isfinite(number(value, what)) or int(value) != value:
        raise ScriptError(f"{what} must be a whole number, not {text_of(value)}")
    return int(value)


def text_of(value: Value) -> str:
    """As the controller writes it."""
    if isinstance(value, Pose):
        return "p" + _list_text(value)
    if isinstance(value, list):
        return _list_text(value)
    if isinstance(value, dict):
        return "struct(" + ", ".join(f"{name}={text_of(item)}" for name, item in value.items()) + ")"
    if isinstance(value, float):
        return f"{value:.6g}"
    return str(value)


def _list_text(items: list[Any]) -> str:
    return "[" + ", ".join(text_of(item) for item in items) + "]"


def bounded(value: Value) -> Value:
    """The value, unless it is too large to keep."""
    if isinstance(value, int) and abs(value) > _EXACT_INT:
        return float(value)
    if isinstance(value, str) and len(value) > TEXT_CHARACTERS:
        raise ScriptError(f"a text of more than {TEXT_CHARACTERS} characters")
    if isinstance(value, list | dict) and items_in(value) > LIST_ITEMS:
        raise ScriptError(f"a list of more than {LIST_ITEMS} items")
    return value


def items_in(value: Value) -> int:
    """Items of a list or struct and of those within it; counted no further than is allowed."""
    count, parts = 0, [value]
    while parts and count <= LIST_ITEMS:
        part = parts.pop()
        inner = part.values() if isinstance(part, dict) else part
        count += len(inner)
        parts += [item for item in inner if isinstance(item, list | dict)]
    return count


def _modulo(a: float, b: float) -> float:
    return int(fmod(a, b)) if isinstance(a, int) and isinstance(b, int) else fmod(a, b)


_ARITHMETIC: Final[dict[str, Callable[[Any, Any], Any]]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "%": _modulo,
}
_ORDER: Final[dict[str, Callable[[Any, Any], bool]]] = {
    "<": lambda a, b: a < b,
    ">": lambda a, b: a > b,
    "<=": lambda a, b: a <= b,
    ">=": lambda a, b: a >= b,
}


def combine(operator: str, a: Value, b: Value) -> Value:
    """`a operator b` of any operator that needs both values."""
    if operator in ("==", "!="):
        same = type(a) is type(b) or (is_number(a) and is_number(b))
        return bool(same and a == b) == (operator == "==")
    if operator == "xor":
        return truth(a) != truth(b)
    if operator in _ORDER:
        if is_number(a) and is_number(b):
            return _ORDER[operator](a, b)
        raise ScriptError(f"'{operator}' needs numbers, not {text_of(a)} and {text_of(b)}")
    if is_number(a) and is_number(b):
        try:
            return bounded(_ARITHMETIC[operator](a, b))
        except (ArithmeticError, ValueError) as error:
            raise ScriptError(f"{text_of(a)} {operator} {text_of(b)}: {error}") from None
    if isinstance(a, str) and isinstance(b, str) and operator == "+":
        return bounded(a + b)
    return _combine_lists(operator, a, b)


def _combine_lists(operator: str, a: Value, b: Value) -> Value:
    """Item by item, or every item with one number."""
    plain = not isinstance(a, Pose) and not isinstance(b, Pose)
    if plain and isinstance(a, list) and isinstance(b, list) and operator in "+-" and len(a) == len(b):
        return [combine(operator, x, y) for x, y in zip(a, b, strict=True)]
    if plain and isinstance(a, list) and is_number(b) and operator in "*/%":
        return [combine(operator, x, b) for x in a]
    if plain and is_number(a) and isinstance(b, list) and operator == "*":
        return [combine(operator, a, x) for x in b]
    raise ScriptError(f"'{operator}' of {text_of(a)} and {text_of(b)} is not simulated")


def item_of(holder: Value, index: Value) -> Value:
    """`holder[index]`."""
    at = whole(index, "an index")
    if not isinstance(holder, list) or not 0 <= at < len(holder):
        raise ScriptError(f"{text_of(holder)} has no item {at}")
    return holder[at]


def pose_from(items: list[Value]) -> Pose:
    """`p[...]`."""
    if len(items) != 6:
        raise ScriptError(f"a pose has 6 numbers, not {len(items)}")
    return Pose([number(item, "a pose's item") for item in items])


def signed(operator: str, value: Value) -> Value:
    """`operator value` of an operator that stands before it."""
    if operator == "not":
        return not truth(value, "what 'not' turns")
    if operator == "-":
        return combine("*", -1, value)
    return value
