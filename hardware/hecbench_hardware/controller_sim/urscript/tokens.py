"""Words of URScript."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from hecbench_hardware.controller_sim.arm import ScriptError

KEYWORDS: Final = frozenset(
    [
        "def",
        "sec",
        "thread",
        "end",
        "if",
        "elif",
        "else",
        "while",
        "return",
        "break",
        "continue",
        "halt",
        "pass",
        "run",
        "join",
        "kill",
        "enter_critical",
        "exit_critical",
        "global",
        "local",
        "and",
        "or",
        "xor",
        "not",
        "True",
        "False",
    ]
)
OPENERS: Final = frozenset({"def", "sec", "thread", "if", "while"})
"""Words that begin a block; `end` ends it."""
_CONTINUED: Final = frozenset({"and", "or", "xor", "not", "=", "+", "-", "*", "/", "%"})
"""Words after which a line goes on in the next."""
_TOKEN = re.compile(
    r"""(?P<space>[ \t\r\f\v]+|\#[^\n]*)
    |(?P<number>0[xX][0-9a-fA-F]+|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)
    |(?P<string>"[^"\n]*")
    |(?P<name>[^\W\d]\w*)
    |(?P<operator>==|!=|<=|>=|[-+*/%<>=()\[\],:.;])
    |(?P<newline>\n)""",
    re.VERBOSE,
)
_ANNOTATION = re.compile(r"^[ \t]*\$[^\n]*", re.MULTILINE)
"""A line in which the pendant names the node of a program."""


@dataclass(frozen=True, slots=True)
class Token:
    """A word, its kind (a keyword's and an operator's kind is itself), and the line it stands on."""

    kind: str
    text: str
    line: int


def syntax_error(line: int, complaint: str) -> ScriptError:
    """The error of a text that is no program."""
    error = ScriptError(f"syntax error: {complaint}")
    error.line = line
    return error


def tokens(text: str) -> list[Token]:
    """The words of a program, the last one of kind "" on the line after it."""
    text = _ANNOTATION.sub("", text)
    found: list[Token] = []
    at, line, open_brackets = 0, 1, 0
    while at < len(text):
        match = _TOKEN.match(text, at)
        if not match:
            raise syntax_error(line, f"'{text[at]}' cannot stand here")
        at, kind, word = match.end(), str(match.lastgroup), match[0]
        if kind == "newline":
            if not open_brackets and not (found and found[-1].kind in _CONTINUED):
                found.append(Token("newline", word, line))
            line += 1
        elif kind == "operator":
            open_brackets = max(0, open_brackets + (word in "([") - (word in ")]"))
            found.append(Token("newline" if word == ";" else word, word, line))
        elif kind != "space":
            found.append(Token(word if word in KEYWORDS else kind, word, line))
    found.append(Token("", "", line))
    return found
