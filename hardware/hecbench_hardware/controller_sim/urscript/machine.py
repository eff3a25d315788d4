"""Executes the statements of a URScript program."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from hecbench.se3 import Array
from hecbench_hardware.controller_sim.arm import ScriptError
from hecbench_hardware.controller_sim.urscript.functions import Builtin
from hecbench_hardware.controller_sim.urscript.scheduler import Halted, Scheduler, Steps, Thread
from hecbench_hardware.controller_sim.urscript.scope import Closure, Scope
from hecbench_hardware.controller_sim.urscript.syntax import (
    Assign,
    Binary,
    Call,
    Do,
    Expression,
    Function,
    If,
    Item,
    Jump,
    ListOf,
    Literal,
    Member,
    Name,
    OnThread,
    Return,
    Run,
    Statement,
    Unary,
    While,
)
from hecbench_hardware.controller_sim.urscript.values import (
    Value,
    bounded,
    combine,
    copied,
    item_of,
    items_in,
    pose_from,
    signed,
    text_of,
    truth,
)

if TYPE_CHECKING:
    from hecbench_hardware.controller_sim.program import ProgramRunner
    from hecbench_hardware.controller_sim.urscript.sockets import Sockets

_OLD_ARRAYS = {"digital_out": "set_digital_out", "analog_out": "set_analog_out"}
"""Arrays by which programs of the first generation set outputs."""
STRUCT = "struct"
"""The function that makes a struct of its keywords."""
_CALL_DEPTH = 40
_CALL_STATEMENTS, _ITEMS_PER_STATEMENT = 8, 8
"""What a function of the controller, and arithmetic of a list, count for in a thread's share of a cycle."""
_BREAK, _CONTINUE = object(), object()


@dataclass
class _Returned:
    value: Value


class Machine(Scheduler):
    """One run of one program."""

    def __init__(self, runner: ProgramRunner, sockets: Sockets, library: dict[str, Builtin]) -> None:
        super().__init__(runner, sockets)
        self.arm, self._library = runner.arm, library
        self.waypoint: Array | None = None
        """Where the present or last motion goes, as a pose vector (6,)."""

    def run(self, body: list[Statement]) -> Steps:
        """Execute a program to its end."""
        return self.take_turns(self._body(body, Scope()))

    # statements

    def _body(self, body: list[Statement], scope: Scope) -> Steps:
        for statement in body:
            if isinstance(statement, Function):
                scope.functions[statement.name] = Closure(statement, scope)
        for statement in body:
            signal = yield from self._statement(statement, scope)
            if signal is not None:
                return signal
        return None

    def _statement(self, statement: Statement, scope: Scope) -> Steps:
        thread = self.current
        assert thread
        thread.line = statement.line
        if self.spend(thread):
            yield
        if isinstance(statement, Assign):
            value = yield from self._value(statement.value, scope)
            yield from self._assign(statement, value, scope)
        elif isinstance(statement, Do):
            yield from self._value(statement.value, scope)
        elif isinstance(statement, If):
            return (yield from self._if(statement, scope))
        elif isinstance(statement, While):
            return (yield from self._while(statement, scope))
        elif isinstance(statement, Return):
            value = None
            if statement.value is not None:
                value = yield from self._value(statement.value, scope)
            return _Returned(copied(value))
        elif isinstance(statement, Jump):
            return self._jump(statement.word, thread)
        elif isinstance(statement, OnThread):
            yield from self._on_thread(statement, scope)
        return None

    def _jump(self, word: str, thread: Thread) -> object | None:
        if word == "halt":
            raise Halted
        if word == "enter_critical":
            self.critical = thread
        elif word == "exit_critical" and self.critical is thread:
            self.critical = None
        return {"break": _BREAK, "continue": _CONTINUE}.get(word)

    def _if(self, statement: If, scope: Scope) -> Steps:
        for condition, body in statement.branches:
            if truth((yield from self._value(condition, scope))):
                return (yield from self._body(body, scope))
        return (yield from self._body(statement.otherwise, scope))

    def _while(self, statement: While, scope: Scope) -> Steps:
        thread = self.current
        assert thread
        while truth((yield from self._value(statement.condition, scope))):
            signal = yield from self._body(statement.body, scope)
            if signal is _BREAK:
                break
            if isinstance(signal, _Returned):
                return signal
            if self.spend(thread):
                yield
        return None

    def _on_thread(self, statement: OnThread, scope: Scope) -> Steps:
        thread = yield from self._value(statement.thread, scope)
        if isinstance(thread, Thread):
            if statement.word == "kill":
                self.kill(thread)
            while thread.alive and statement.word == "join":
                yield
            if thread is self.current:
                yield  # killed by itself: it gets no further turn
        elif thread != 0:
            raise ScriptError(f"{statement.word} needs a thread, not {text_of(thread)}")

    def _assign(self, statement: Assign, value: Value, scope: Scope) -> Steps:
        target, value = statement.target, copied(bounded(value))
        if isinstance(value, list | dict) and self.current:
            self.current.budget -= items_in(value) // _ITEMS_PER_STATEMENT
        if isinstance(target, Name):
            scope.assign(target.name, value, statement.scope)
            return
        if isinstance(target, Item) and isinstance(target.target, Name) and target.target.name in _OLD_ARRAYS:
            index = yield from self._values(target.indices, scope)
            yield from self._library[_OLD_ARRAYS[target.target.name]].call(self, [*index, value], {})
            return
        holder = yield from self._value(target.target, scope)
        if isinstance(target, Member):
            if not isinstance(holder, dict) or target.name not in holder:
                raise ScriptError(f"{text_of(holder)} has no member '{target.name}'")
            holder[target.name] = value
            bounded(holder)
            return
        *outer, last = (yield from self._values(target.indices, scope)) or [None]
        for index in outer:
            holder = item_of(holder, index)
        item_of(holder, last)
        holder[int(last)] = value
        bounded(holder)

    # expressions

    def _value(self, node: Expression, scope: Scope) -> Steps:
        if isinstance(node, Literal):
            return node.value
        if isinstance(node, Name):
            return scope.value(node.name)
        if isinstance(node, Binary):
            return (yield from self._binary(node, scope))
        if isinstance(node, Call):
            return (yield from self._call(node, scope))
        if isinstance(node, Item):
            holder = yield from self._value(node.target, scope)
            for index in (yield from self._values(node.indices, scope)):
                holder = item_of(holder, index)
            return holder
        if isinstance(node, ListOf):
            items = yield from self._values(node.items, scope)
            return pose_from(items) if node.is_pose else bounded(items)
        if isinstance(node, Unary):
            return signed(node.operator, (yield from self._value(node.operand, scope)))
        if isinstance(node, Member):
            holder = yield from self._value(node.target, scope)
            if not isinstance(holder, dict) or node.name not in holder:
                raise ScriptError(f"{text_of(holder)} has no member '{node.name}'")
            return holder[node.name]
        return self.spawn((yield from self._started(node, scope)))

    def _values(self, nodes: list[Expression], scope: Scope) -> Steps:
        values = []
        for node in nodes:
            value = node.value if isinstance(node, Literal) else (yield from self._value(node, scope))
            values.append(value)
        return values

    def _binary(self, node: Binary, scope: Scope) -> Steps:
        left = yield from self._value(node.left, scope)
        if node.operator in ("and", "or"):
            if truth(left) is (node.operator == "or"):
                return left
            return truth((yield from self._value(node.right, scope)))
        result = combine(node.operator, left, (yield from self._value(node.right, scope)))
        if isinstance(result, list) and self.current:
            self.current.budget -= items_in(result) // _ITEMS_PER_STATEMENT
        return result

    def _call(self, node: Call, scope: Scope) -> Steps:
        arguments = yield from self._values(node.arguments, scope)
        keywords = {}
        for name, argument in node.keywords.items():
            keywords[name] = yield from self._value(argument, scope)
        closure = scope.function(node.name)
        if closure is None and node.name == STRUCT:
            return bounded({name: copied(value) for name, value in keywords.items()})
        thread = self.current
        assert thread
        if closure is None:
            thread.budget -= _CALL_STATEMENTS
            return (yield from self._library[node.name].call(self, arguments, keywords))
        if thread.depth >= _CALL_DEPTH:
            raise ScriptError(f"more than {_CALL_DEPTH} calls within each other")
        inner = yield from self._bound(closure, arguments, keywords)
        thread.depth += 1
        signal = yield from self._body(closure.function.body, inner)
        thread.depth -= 1
        return signal.value if isinstance(signal, _Returned) else None

    def _started(self, node: Run, scope: Scope) -> Steps:
        arguments = yield from self._values(node.call.arguments, scope)
        closure = scope.function(node.call.name)
        if closure is None:
            raise ScriptError(f"'{node.call.name}' is no thread of this program")
        inner = yield from self._bound(closure, arguments, {})
        return self._body(closure.function.body, inner)

    def _bound(self, closure: Closure, arguments: list[Value], keywords: dict[str, Value]) -> Steps:
        """The scope of a call, with its arguments as variables."""
        function, inner = closure.function, Scope(closure.scope)
        names = [name for name, _ in function.parameters]
        if len(arguments) > len(names) or not keywords.keys() <= set(names):
            raise ScriptError(f"{function.name}() takes ({', '.join(names)})")
        given = {**dict(zip(names, arguments, strict=False)), **keywords}
        for name, default in function.parameters:
            if name not in given and default is None:
                raise ScriptError(f"{function.name}() needs '{name}'")
            if name not in given and default is not None:
                given[name] = yield from self._value(default, closure.scope)
            inner.variables[name] = copied(given[name])
        return inner
