"""What a URScript program consists of."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias


@dataclass(slots=True)
class Node:
    """Stands on a line."""

    line: int


@dataclass(slots=True)
class Literal(Node):
    """A number, a text, True or False."""

    value: bool | int | float | str


@dataclass(slots=True)
class Name(Node):
    """A variable."""

    name: str


@dataclass(slots=True)
class ListOf(Node):
    """`[...]`, or a pose `p[...]`."""

    items: list[Expression]
    is_pose: bool


@dataclass(slots=True)
class Item(Node):
    """`target[index]`, of a matrix `target[row, column]`."""

    target: Expression
    indices: list[Expression]


@dataclass(slots=True)
class Member(Node):
    """`target.name` of a struct."""

    target: Expression
    name: str


@dataclass(slots=True)
class Call(Node):
    """`name(arguments, keyword=argument)`."""

    name: str
    arguments: list[Expression]
    keywords: dict[str, Expression]


@dataclass(slots=True)
class Run(Node):
    """`run name(arguments)`: a thread."""

    call: Call


@dataclass(slots=True)
class Unary(Node):
    """`not x`, `-x`, `+x`."""

    operator: str
    operand: Expression


@dataclass(slots=True)
class Binary(Node):
    """`left operator right`."""

    operator: str
    left: Expression
    right: Expression


Expression: TypeAlias = Literal | Name | ListOf | Item | Member | Call | Run | Unary | Binary


@dataclass(slots=True)
class Assign(Node):
    """`target = value`; scope is "global", "local" or "" for the nearest."""

    target: Name | Item | Member
    value: Expression
    scope: str


@dataclass(slots=True)
class Do(Node):
    """An expression for its effect."""

    value: Expression


@dataclass(slots=True)
class If(Node):
    """Branches of a condition and a body each, and the body of `else`."""

    branches: list[tuple[Expression, list[Statement]]]
    otherwise: list[Statement]


@dataclass(slots=True)
class While(Node):
    """A loop."""

    condition: Expression
    body: list[Statement]


@dataclass(slots=True)
class Return(Node):
    """`return value`."""

    value: Expression | None


@dataclass(slots=True)
class Jump(Node):
    """`break`, `continue`, `halt`, `pass`, `enter_critical`, `exit_critical`."""

    word: str


@dataclass(slots=True)
class OnThread(Node):
    """`join thread` or `kill thread`."""

    word: str
    thread: Expression


@dataclass(slots=True)
class Function(Node):
    """`def`, `sec` or `thread`."""

    word: str
    name: str
    parameters: list[tuple[str, Expression | None]]
    body: list[Statement] = field(default_factory=list)


Statement: TypeAlias = Assign | Do | If | While | Return | Jump | OnThread | Function
