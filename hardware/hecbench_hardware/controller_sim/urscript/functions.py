"""How a function of URScript is written down here, and called."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any, ClassVar

from hecbench_hardware.controller_sim.arm import ScriptError
from hecbench_hardware.controller_sim.urscript.unsimulated import UNSIMULATED, Unsimulated
from hecbench_hardware.controller_sim.urscript.values import Value, bounded


@dataclass(frozen=True)
class Builtin:
    """A function of the controller. A generator function takes time: one cycle per `yield`."""

    REQUIRED: ClassVar[Any] = inspect.Parameter.empty
    """Default of a parameter that has none."""
    name: str
    function: Callable[..., Any]
    parameters: tuple[tuple[str, Any], ...]
    unsimulated: tuple[Unsimulated, ...] = ()

    def call(
        self, machine: Any, arguments: list[Value], keywords: dict[str, Value]
    ) -> Generator[None, None, Value]:
        """Run it; a wrong argument is an error of the program."""
        bound = self._bind(arguments, keywords)
        for (name, _), value in zip(self.parameters, bound, strict=True):
            for known in self.unsimulated:
                if known.parameter == name and (said := known.said(value)):
                    machine.runner.admit(f"{self.name}(): {said}")
        try:
            result = self.function(machine, *bound)
            if isinstance(result, Generator):
                result = yield from result
        except ScriptError as error:
            raise ScriptError(_prefixed(self.name, str(error))) from None
        except (TypeError, ValueError, IndexError, KeyError, ArithmeticError) as error:
            raise ScriptError(f"{self.name}(): {error}") from None
        return bounded(result)

    def _bind(self, arguments: list[Value], keywords: dict[str, Value]) -> list[Value]:
        names = [name for name, _ in self.parameters]
        taken = names[: len(arguments)]
        wrong = [name for name in keywords if name not in names or name in taken]
        if len(arguments) > len(names) or wrong:
            raise ScriptError(f"{self.name}() takes ({', '.join(names)})")
        given = {**dict(zip(taken, arguments, strict=True)), **keywords}
        values = [given.get(name, default) for name, default in self.parameters]
        missing = [name for name, value in zip(names, values, strict=True) if value is self.REQUIRED]
        if missing:
            raise ScriptError(f"{self.name}() needs '{missing[0]}'")
        return values


def _prefixed(name: str, complaint: str) -> str:
    return complaint if complaint.startswith(name) else f"{name}(): {complaint}"


def builtins(*functions: Callable[..., Any]) -> dict[str, Builtin]:
    """Functions by their URScript names; the first parameter is the machine, a trailing underscore is cut."""
    found = {}
    for function in functions:
        parameters = list(inspect.signature(function).parameters.values())[1:]
        name = function.__name__.rstrip("_")
        written = tuple((p.name.rstrip("_"), p.default) for p in parameters)
        found[name] = Builtin(name, function, written, UNSIMULATED.get(name, ()))
    return found
