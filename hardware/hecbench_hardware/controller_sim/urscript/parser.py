"""From the words of a URScript program to its structure."""

from __future__ import annotations

from hecbench_hardware.controller_sim.arm import ScriptError
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
from hecbench_hardware.controller_sim.urscript.tokens import KEYWORDS, Token, syntax_error, tokens

_LEVELS = (
    ("or",),
    ("xor",),
    ("and",),
    ("not",),
    ("==", "!=", "<", ">", "<=", ">="),
    ("+", "-"),
    ("*", "/", "%"),
)
"""Operators by rising precedence; `not` is the one that stands before its operand."""
_NOT = 3
_JUMPS = ("break", "continue", "halt", "pass", "enter_critical", "exit_critical")
_DEPTH = 60
"""Blocks and brackets within each other."""
_DIGITS = 18
"""A longer number is a float."""


def parse(text: str) -> list[Statement]:
    """The statements of a program; raises `ScriptError` with the line of what is wrong."""
    try:
        return _Parser(tokens(text)).program()
    except RecursionError:
        raise syntax_error(0, "the program is too deeply nested") from None


class _Parser:
    def __init__(self, words: list[Token]) -> None:
        self._words, self._at, self._depth = words, 0, 0

    def program(self) -> list[Statement]:
        body = self._body(())
        self._expect("")
        return body

    # words

    @property
    def _word(self) -> Token:
        return self._words[self._at]

    def _take(self) -> Token:
        word = self._word
        self._at += 1
        return word

    def _skip(self, kind: str) -> bool:
        if self._word.kind != kind:
            return False
        self._at += 1
        return True

    def _expect(self, kind: str) -> Token:
        if self._word.kind != kind:
            raise self._error(f"'{kind}' expected" if kind else "the program ends here")
        return self._take()

    def _error(self, complaint: str) -> ScriptError:
        found = self._word.text.strip() or ("the end of the line" if self._word.kind else "the end")
        return syntax_error(self._word.line, f"{complaint}, found {found!r}")

    # statements

    def _body(self, ends: tuple[str, ...]) -> list[Statement]:
        self._enter()
        body: list[Statement] = []
        while True:
            while self._skip("newline"):
                pass
            if self._word.kind in ends or not self._word.kind:
                break
            body.append(self._statement())
            if self._word.kind not in ("newline", "", "name", *KEYWORDS):
                raise self._error("a new line expected")
        self._depth -= 1
        return body

    def _enter(self) -> None:
        self._depth += 1
        if self._depth > _DEPTH:
            raise syntax_error(self._word.line, f"more than {_DEPTH} levels within each other")

    def _statement(self) -> Statement:
        kind, line = self._word.kind, self._word.line
        if kind in ("def", "sec", "thread"):
            return self._function()
        if kind == "if":
            return self._if()
        if kind == "while":
            self._take()
            condition = self._expression()
            return While(line, condition, self._block("end"))
        if kind == "return":
            self._take()
            ended = self._word.kind in ("newline", "", "end", "else", "elif")
            return Return(line, None if ended else self._expression())
        if kind in _JUMPS:
            return Jump(line, self._take().kind)
        if kind in ("join", "kill"):
            return OnThread(line, self._take().kind, self._expression())
        return self._assignment()

    def _block(self, *ends: str) -> list[Statement]:
        """The body after a colon, without the word that ends it unless it is `end`."""
        self._skip(":")
        body = self._body(ends)
        if self._word.kind not in ends:
            raise self._error(f"'{ends[-1]}' expected")
        if ends == ("end",):
            self._take()
        return body

    def _function(self) -> Function:
        start = self._take()
        name = self._expect("name").text
        self._expect("(")
        parameters: list[tuple[str, Expression | None]] = []
        while not self._skip(")"):
            parameter = self._expect("name").text
            parameters.append((parameter, self._expression() if self._skip("=") else None))
            if not self._skip(",") and self._word.kind != ")":
                raise self._error("',' or ')' expected")
        return Function(start.line, start.kind, name, parameters, self._block("end"))

    def _if(self) -> If:
        line = self._take().line
        branches = [(self._expression(), self._block("elif", "else", "end"))]
        while self._skip("elif"):
            branches.append((self._expression(), self._block("elif", "else", "end")))
        if self._skip("else"):
            return If(line, branches, self._block("end"))
        self._expect("end")
        return If(line, branches, [])

    def _assignment(self) -> Statement:
        line = self._word.line
        scope = self._take().kind if self._word.kind in ("global", "local") else ""
        value = self._expression()
        if not self._skip("="):
            if scope:
                raise self._error("'=' expected")
            return Do(line, value)
        if not isinstance(value, Name | Item | Member):
            raise syntax_error(line, "only a variable, an item or a member can be assigned to")
        return Assign(line, value, self._expression(), scope)

    # expressions

    def _expression(self, level: int = 0) -> Expression:
        if level == len(_LEVELS):
            return self._sign()
        if level == _NOT:
            if self._word.kind == "not":
                self._enter()
                line = self._take().line
                operand = self._expression(_NOT)
                self._depth -= 1
                return Unary(line, "not", operand)
            return self._expression(level + 1)
        left = self._expression(level + 1)
        while self._word.kind in _LEVELS[level]:
            operator = self._take()
            left = Binary(operator.line, operator.kind, left, self._expression(level + 1))
        return left

    def _sign(self) -> Expression:
        if self._word.kind in ("-", "+"):
            self._enter()
            sign = self._take()
            operand = self._sign()
            self._depth -= 1
            return Unary(sign.line, sign.kind, operand)
        return self._postfix()

    def _postfix(self) -> Expression:
        value = self._atom()
        while True:
            line = self._word.line
            if self._skip("["):
                value = Item(line, value, self._items("]"))
            elif self._skip("."):
                value = Member(line, value, self._expect("name").text)
                if self._word.kind == "(":
                    raise self._error("methods are not simulated")
            else:
                return value

    def _atom(self) -> Expression:
        word = self._word
        if word.kind == "number":
            self._take()
            return Literal(word.line, _number(word.text))
        if word.kind == "string":
            self._take()
            return Literal(word.line, word.text[1:-1])
        if word.kind in ("True", "False"):
            return Literal(word.line, self._take().kind == "True")
        if word.kind == "run":
            self._take()
            call = self._atom()
            if not isinstance(call, Call):
                raise syntax_error(word.line, "'run' needs a thread and its brackets")
            return Run(word.line, call)
        if word.kind == "name":
            return self._named()
        if self._skip("["):
            return ListOf(word.line, self._items("]"), is_pose=False)
        if self._skip("("):
            return self._bracketed(word.line)
        raise self._error("a value expected")

    def _bracketed(self, line: int) -> Expression:
        """`(value)`, or with commas a list."""
        items = self._items(")")
        if not items:
            raise syntax_error(line, "nothing between brackets")
        return items[0] if len(items) == 1 else ListOf(line, items, is_pose=False)

    def _named(self) -> Expression:
        word = self._take()
        if word.text == "p" and self._word.kind == "[":
            self._take()
            items = self._items("]")
            if len(items) == 1:  # a variable of this name
                return Item(word.line, Name(word.line, word.text), items)
            return ListOf(word.line, items, is_pose=True)
        if not self._skip("("):
            return Name(word.line, word.text)
        self._enter()
        call = Call(word.line, word.text, [], {})
        while not self._skip(")"):
            value = self._expression()
            if self._word.kind == "=" and isinstance(value, Name):
                self._take()
                call.keywords[value.name] = self._expression()
            else:
                call.arguments.append(value)
            if not self._skip(",") and self._word.kind != ")":
                raise self._error("',' or ')' expected")
        self._depth -= 1
        return call

    def _items(self, end: str) -> list[Expression]:
        self._enter()
        items: list[Expression] = []
        while not self._skip(end):
            items.append(self._expression())
            if not self._skip(",") and self._word.kind != end:
                raise self._error(f"',' or '{end}' expected")
        self._depth -= 1
        return items


def _number(text: str) -> int | float:
    if text[:2].lower() == "0x":
        return int(text[:_DIGITS], 16)
    return int(text) if text.isdecimal() and len(text) <= _DIGITS else float(text)
