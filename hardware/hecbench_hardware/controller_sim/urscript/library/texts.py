"""Texts, messages and the pendant."""

from __future__ import annotations

from typing import Final

from hecbench_hardware.controller_sim.arm import ScriptError
from hecbench_hardware.controller_sim.motions import Motion
from hecbench_hardware.controller_sim.urscript.functions import builtins
from hecbench_hardware.controller_sim.urscript.machine import Machine
from hecbench_hardware.controller_sim.urscript.values import Value, text, text_of, truth, whole


def textmsg(m: Machine, s1: Value, s2: Value = "") -> None:
    """A line in the pendant's log: here in the log, and to the primary clients."""
    line = text_of(s1) + text_of(s2)
    m.arm.note(f"textmsg: {line}")
    m.runner.messages.text(m.arm.time_s, line)


def popup(
    m: Machine,
    s: Value,
    title: Value = "Popup",
    warning: Value = False,
    error: Value = False,
    blocking: Value = False,
) -> Motion:
    """A window on the pendant; a blocking one waits until the dashboard closes it."""
    content, heading = text_of(s), text_of(title)
    kind = {"warning": truth(warning), "error": truth(error), "blocking": truth(blocking)}
    m.arm.note(f"popup: {heading}: {content}")
    m.runner.messages.popup(m.arm.time_s, content, heading, **kind)
    m.runner.popup = content
    while blocking and m.runner.popup is not None:
        yield


def str_cat(_: Machine, op1: Value, op2: Value) -> str:
    """Two values as one text."""
    return text_of(op1) + text_of(op2)


def str_len(_: Machine, str_: Value) -> int:
    """Its characters."""
    return len(text(str_))


def str_empty(_: Machine, str_: Value) -> bool:
    """Whether it has none."""
    return not text(str_)


def str_at(_: Machine, src: Value, index: Value) -> str:
    """One character."""
    if not 0 <= whole(index, "index") < len(text(src)):
        raise ScriptError(f"a text of {len(src)} characters has no character {index}")
    return text(src)[whole(index)]


def str_find(_: Machine, src: Value, target: Value, start_from: Value = 0) -> int:
    """Where it occurs first, or -1."""
    return text(src).find(text(target), whole(start_from))


def str_sub(_: Machine, src: Value, index: Value, len_: Value = -1) -> str:
    """A part of a text; without a length, up to its end."""
    first, count = whole(index, "index"), whole(len_, "len")
    return text(src)[first:] if count < 0 else text(src)[first : first + count]


def to_str(_: Machine, val: Value) -> str:
    """As text."""
    return text_of(val)


def to_num(_: Machine, str_: Value) -> float:
    """A number that a text writes."""
    words = text(str_).strip()
    return int(words) if words.lstrip("+-").isdecimal() and len(words) < _INTEGER_DIGITS else float(words)


_INTEGER_DIGITS = 18

FUNCTIONS: Final = builtins(
    textmsg, popup, str_cat, str_len, str_empty, str_at, str_find, str_sub, to_str, to_num
)
