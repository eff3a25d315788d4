"""Poses as robot programs write them: ABB's robtargets, and numbers with their letters as KUKA, FANUC or Staubli."""

from __future__ import annotations

import re
from collections.abc import Sequence

_NUMBER = r"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?"
_LETTERED = re.compile(
    rf"(?<![\w.])([A-Za-z]{{1,5}}\d?)\s*[=:]?\s*({_NUMBER})(?:\s*(mm|cm|m|deg|rad)\b)?(?![\w.])"
)
_ROBTARGET = re.compile(
    rf"\[\s*\[((?:\s*{_NUMBER}\s*,?){{3}})\]\s*,\s*\[((?:\s*{_NUMBER}\s*,?){{4}})\]\s*,\s*\[[^\[\]]*\]\s*,\s*\[[^\[\]]*\]\s*\]"
)
_TURNS = ({"a", "b", "c"}, {"w", "p", "r"}, {"rx", "ry", "rz"}, {"o", "a", "t"}, {"u", "v", "w"})


def literal_rows(lines: Sequence[str]) -> list[list[str]] | None:
    """A row of titles, and the cells of every line, where all lines are written in one of these ways; else None."""
    return _robtargets(lines) or _lettered(lines)


def _robtargets(lines: Sequence[str]) -> list[list[str]] | None:
    """``[[x,y,z],[q1,q2,q3,q4],[...],[...]]``, in a declaration or alone."""
    found = [_ROBTARGET.search(line) for line in lines]
    if not all(found):
        return None
    cells = [re.findall(_NUMBER, f"{match[1]},{match[2]}") for match in found if match]
    return [["x", "y", "z", "q1", "q2", "q3", "q4"], *cells]


def _lettered(lines: Sequence[str]) -> list[list[str]] | None:
    """``{X 100, Y 20, Z 300, A 90, B 0, C 180, S 6, T 27}``, ``X = 100 mm, ...``: the letters of a pose alone."""
    rows = []
    for line in lines:
        cells = {letter.lower(): (number, unit) for letter, number, unit in _LETTERED.findall(line)}
        turn = next((letters for letters in _TURNS if letters <= cells.keys()), None)
        if turn is None or not {"x", "y", "z"} <= cells.keys():
            return None
        rows.append({letter: cells[letter] for letter in ("x", "y", "z", *sorted(turn))})
    if any(row.keys() != rows[0].keys() for row in rows):
        return None
    titles = [f"{letter} {unit}".strip() for letter, (_, unit) in rows[0].items()]
    return [titles, *([number for number, _ in row.values()] for row in rows)]
