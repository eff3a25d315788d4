"""What a program calls must exist before it starts: nothing moves of a program that cannot be executed whole."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import fields, is_dataclass
from typing import Any

from hecbench_hardware.controller_sim.arm import ScriptError
from hecbench_hardware.controller_sim.urscript.syntax import Call, Function, Run, Statement

UNKNOWN = "is not defined by the program, and not simulated"


def check_calls(body: list[Statement], known: Collection[str], complaint: str = UNKNOWN) -> None:
    """Raise `ScriptError` for the first call of a function that is neither the program's own nor known."""
    nodes = list(_nodes(body))
    own = {node.name for node in nodes if isinstance(node, Function)}
    for node in nodes:
        call = node.call if isinstance(node, Run) else node
        if isinstance(call, Call) and call.name not in own and call.name not in known:
            error = ScriptError(f"'{call.name}' {complaint}")
            error.line = call.line
            raise error


def _nodes(value: Any) -> Iterator[Any]:
    """Every part of a program, in the order of its text."""
    stack = [value]
    while stack:
        part = stack.pop()
        if isinstance(part, list | tuple):
            stack.extend(reversed(part))
        elif isinstance(part, dict):
            stack.extend(reversed(part.values()))
        elif is_dataclass(part) and not isinstance(part, type):
            yield part
            stack.extend(getattr(part, f.name) for f in reversed(fields(part)))
