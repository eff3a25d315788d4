"""Texts, messages and the pendant."""

from __future__ import annotations

from typing import Final

from hecbench_hardware.controller_sim.arm import ScriptError
from hecbench_hardware.controller_sim.motions import Motion
from hecbench_hardware.controller_sim.urscript.functions import builtins
from hecbench_hardware.controller_sim.urscript.machine import Machine
from hecbench_hardware.controller_sim.urscript.values import Value, text_of


def textmsg(m: Machine, s1: Value, s2: Value = "") -> None:
    """A line in the pendant's log: here in the log, and to the primary clients."""
    text = text_of(s1) + text_of(s2)
    m.arm.note(f"textmsg: {text}")
    m.runner.messages.text(m.arm.time_s, text)


def popup(
    m: Machine,
    s: Value,
    title: Value = "Popup",
    warning: Value = False,
    error: Value = False,
    blocking: Value = False,
) -> Motion:
    """A window on the pendant; a blocking one waits until the dashboard closes it."""
    text = text_of(s)
    m.arm.note(f"popup: {text_of(title)}: {text}")
    m.runner.messages.popup(
        m.arm.time_s, text, text_of(title), warning=warning, error=error, blocking=blocking
    )
    m.runner.popup = text
    while blocking and m.runner.popup is not None:
        yield


def str_cat(_: Machine, op1: Value, op2: Value) -> str:
    """Two values as one text."""
    return text_of(op1) + text_of(op2)


def str_len(_: Machine, str_: str) -> int:
    """Its characters."""
    return len(str_)


def str_empty(_: Machine, str_: str) -> bool:
    """Whether it has none."""
    return not str_


def str_at(_: Machine, src: str, index: int) -> str:
    """One character."""
    if not 0 <= index < len(src):
        raise ScriptError(f"a text of {len(src)} characters has no character {index}")
    return src[index]


def str_find(_: Machine, src: str, target: str, start_from: int = 0) -> int:
    """Where it occurs first, or -1."""
    return src.find(target, start_from)


def str_sub(_: Machine, src: str, index: int, len_: int = -1) -> str:
    """A part of a text; without a length, up to its end."""
    return src[index:] if len_ < 0 else src[index : index + len_]


def to_str(_: Machine, val: Value) -> str:
    """As text."""
    return text_of(val)


def to_num(_: Machine, str_: str) -> float:
    """A number that a text writes."""
    return int(str_) if str_.strip().lstrip("+-").isdecimal() else float(str_)


FUNCTIONS: Final = builtins(
    textmsg, popup, str_cat, str_len, str_empty, str_at, str_find, str_sub, to_str, to_num
)
