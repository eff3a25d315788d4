"""Variables and functions of a running URScript program."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from hecbench_hardware.controller_sim.arm import ScriptError
from hecbench_hardware.controller_sim.urscript.syntax import Function
from hecbench_hardware.controller_sim.urscript.values import Value

_VARIABLES = 1000


@dataclass
class Scope:
    """Variables of one call, and the scope in which its function was defined."""

    outer: Scope | None = None
    variables: dict[str, Value] = field(default_factory=dict)
    functions: dict[str, Closure] = field(default_factory=dict)

    def chain(self) -> Iterator[Scope]:
        """This scope and those around it."""
        scope: Scope | None = self
        while scope:
            yield scope
            scope = scope.outer

    def value(self, name: str) -> Value:
        """The nearest variable of this name."""
        for scope in self.chain():
            if name in scope.variables:
                return scope.variables[name]
        raise ScriptError(f"the name '{name}' is not defined")

    def function(self, name: str) -> Closure | None:
        """The nearest function of this name, if the program has one."""
        return next((scope.functions[name] for scope in self.chain() if name in scope.functions), None)

    def assign(self, name: str, value: Value, how: str) -> None:
        """Set the nearest variable of this name, or a new one here; or where `how` says."""
        target = self
        if how == "global":
            *_, target = self.chain()
        elif not how:
            target = next((scope for scope in self.chain() if name in scope.variables), self)
        target.variables[name] = value
        if len(target.variables) > _VARIABLES:
            raise ScriptError(f"more than {_VARIABLES} variables")


@dataclass(frozen=True)
class Closure:
    """A function and the scope in which it was defined."""

    function: Function
    scope: Scope
