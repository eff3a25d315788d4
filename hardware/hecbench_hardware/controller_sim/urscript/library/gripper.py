"""The functions that the URCap of the Robotiq gripper adds to programs. A client's own definitions go before these."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from hecbench_hardware.controller_sim.arm import ScriptError
from hecbench_hardware.controller_sim.motions import Motion
from hecbench_hardware.controller_sim.urscript.functions import Builtin
from hecbench_hardware.controller_sim.urscript.machine import Machine
from hecbench_hardware.controller_sim.urscript.values import Value, number

OPEN, CLOSED = 0, 255
_STROKE_MM, _OPEN_COUNT, _CLOSED_COUNT = 85.0, 3, 230
"""Width between the pads, and the positions at which they stand that wide and touch."""
_ACTIVE, _MOVING, _HOLDING = 3, 0, (1, 2)


def _percent(value: Value) -> int:
    if not 0 <= number(value) <= 100:
        raise ScriptError(f"a share is 0 to 100, not {value}")
    return round(number(value) * CLOSED / 100)


def _count(value: Value) -> int:
    if not 0 <= number(value) <= CLOSED:
        raise ScriptError(f"a position is 0 to {CLOSED}, not {value}")
    return round(number(value))


def _of_width(width_mm: Value) -> int:
    share = 1 - number(width_mm, "the width") / _STROKE_MM
    return min(max(round(_OPEN_COUNT + share * (_CLOSED_COUNT - _OPEN_COUNT)), OPEN), CLOSED)


def _width(position: int) -> float:
    return _STROKE_MM * (_CLOSED_COUNT - position) / (_CLOSED_COUNT - _OPEN_COUNT)


def _set(m: Machine, text: str) -> None:
    if m.runner.gripper.answer(f"SET {text}") != b"ack":
        raise ScriptError("the gripper does not answer")


def _register(name: str) -> Callable[[Machine], int]:
    return lambda m: m.runner.gripper.registers[name]


def _go(m: Machine, position: int) -> None:
    _set(m, f"POS {position} GTO 1")


def _wait(m: Machine) -> Motion:
    while _register("OBJ")(m) == _MOVING:
        yield


def _go_and_wait(m: Machine, position: int) -> Motion:
    _go(m, position)
    return _wait(m)


def _activate(m: Machine) -> Motion:
    _set(m, "ACT 1 GTO 1")
    while _register("STA")(m) != _ACTIVE:
        yield


_NO_ARGUMENT: Final[dict[str, Callable[[Machine], Any]]] = {
    **dict.fromkeys(("rq_activate", "rq_activate_and_wait"), _activate),
    "rq_reset": lambda m: _set(m, "ACT 0 ATR 0"),
    "rq_open": lambda m: _go(m, OPEN),
    "rq_close": lambda m: _go(m, CLOSED),
    "rq_open_and_wait": lambda m: _go_and_wait(m, OPEN),
    "rq_close_and_wait": lambda m: _go_and_wait(m, CLOSED),
    "rq_stop": lambda m: _set(m, "GTO 0"),
    "rq_wait": _wait,
    "rq_is_gripper_activated": lambda m: _register("STA")(m) == _ACTIVE,
    "rq_is_object_detected": lambda m: _register("OBJ")(m) in _HOLDING,
    "rq_is_motion_complete": lambda m: _register("OBJ")(m) != _MOVING,
    "rq_current_pos": _register("POS"),
    "rq_current_pos_norm": lambda m: round(_register("POS")(m) * 100 / CLOSED),
    "rq_current_pos_mm": lambda m: _width(_register("POS")(m)),
}
_ONE_ARGUMENT: Final[dict[str, Callable[[Machine, Value], Any]]] = {
    "rq_move": lambda m, x: _go(m, _count(x)),
    "rq_move_norm": lambda m, x: _go(m, _percent(x)),
    "rq_move_mm": lambda m, x: _go(m, _of_width(x)),
    "rq_move_and_wait": lambda m, x: _go_and_wait(m, _count(x)),
    "rq_move_and_wait_norm": lambda m, x: _go_and_wait(m, _percent(x)),
    "rq_move_and_wait_mm": lambda m, x: _go_and_wait(m, _of_width(x)),
    "rq_set_speed": lambda m, x: _set(m, f"SPE {_count(x)}"),
    "rq_set_force": lambda m, x: _set(m, f"FOR {_count(x)}"),
    "rq_set_speed_norm": lambda m, x: _set(m, f"SPE {_percent(x)}"),
    "rq_set_force_norm": lambda m, x: _set(m, f"FOR {_percent(x)}"),
}


def _for_any_gripper(name: str, function: Callable[..., Any], own: tuple[str, ...]) -> Builtin:
    """With the number of the gripper as the last argument, of which there is one here."""

    def call(m: Machine, *arguments: Value) -> Any:
        return function(m, *arguments[: len(own)])

    parameters = tuple((parameter, Builtin.REQUIRED) for parameter in own)
    return Builtin(name, call, (*parameters, ("gripper_socket", "1")))


FUNCTIONS: Final = {
    **{name: _for_any_gripper(name, function, ()) for name, function in _NO_ARGUMENT.items()},
    **{name: _for_any_gripper(name, function, ("value",)) for name, function in _ONE_ARGUMENT.items()},
}
