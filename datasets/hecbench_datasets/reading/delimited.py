"""Cells of delimited text in any dialect: separators, decimal commas, signs between thousands, NumPy's brackets."""

from __future__ import annotations

import csv
import io
import re

from hecbench_datasets.reading.robot_literals import literal_rows

_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?")
_THOUSANDS_COMMA = re.compile(r"[+-]?\d{1,3}([.']\d{3})+,\d+")
_THOUSANDS_POINT = re.compile(r"[+-]?\d{1,3}([,']\d{3})+\.\d+")
_BARE_LIST = re.compile(r"[\[\]()\d\s.,;eE+-]*[\[\]][\[\]()\d\s.,;eE+-]*")


def cells(content: str) -> list[list[str]]:
    """Cells of the lines, a header in a comment included; decimal commas become points."""
    lines = [line.strip() for line in content.splitlines()]
    if not any("," in line or ";" in line for line in lines):  # a matrix as NumPy prints it
        lines = [re.sub(r"[\[\]]", " ", x).strip() if _BARE_LIST.fullmatch(x) else x for x in lines]
    data = [line for line in lines if line and not line.startswith(("#", "//", "%"))]
    if not data:
        return []
    if (literals := literal_rows(data)) is not None:
        return literals
    first = lines.index(data[0])
    header = (
        lines[first - 1].lstrip("#/% ") if first and lines[first - 1].startswith(("#", "//", "%")) else ""
    )
    separator = next((mark for mark in ";\t," if _separates(mark, data)), None)
    rows = [[_with_point(cell, separator) for cell in row] for row in _split(data, separator)]
    titles = _split([header], separator)[0] if header else []
    return [titles, *rows] if len(titles) == len(rows[0]) and not any(map(is_number, titles)) else rows


def _with_point(cell: str, separator: str | None) -> str:
    """A number without signs between its thousands, and with a decimal point; other cells as they are."""
    if separator != "," and _DECIMAL_COMMA.fullmatch(cell):
        return cell.replace(",", ".")
    if _THOUSANDS_COMMA.fullmatch(cell):
        return cell.replace(".", "").replace("'", "").replace(",", ".")
    if _THOUSANDS_POINT.fullmatch(cell):
        return cell.replace(",", "").replace("'", "")
    return cell


def _separates(mark: str, lines: list[str]) -> bool:
    """Whether the mark separates cells in most lines, and not the digits of decimal commas."""
    if mark == "," and all(_DECIMAL_COMMA.fullmatch(word) for line in lines[-3:] for word in line.split()):
        return False
    return sum(mark in line for line in lines) > len(lines) / 2


def _split(lines: list[str], separator: str | None) -> list[list[str]]:
    if separator is None:
        return [line.split() for line in lines]
    rows = csv.reader(io.StringIO("\n".join(lines)), delimiter=separator, skipinitialspace=True)
    cells = [[cell.strip() for cell in row] for row in rows]
    while cells and all(row and row[-1] == "" for row in cells):
        cells = [row[:-1] for row in cells]
    if separator == "," and all(len(row) == len(cells[0]) for row in cells):
        return cells
    return [
        [word for cell in row for word in (cell.split() if all_numbers(cell.split()) else [cell])]
        for row in cells
    ]


def is_number(cell: str) -> bool:
    try:
        float(cell)
    except (TypeError, ValueError):
        return False
    return True


def all_numbers(cells: list[str]) -> bool:
    return bool(cells) and all(map(is_number, cells))
