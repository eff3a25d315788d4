"""Tables as people keep them: CSV in any dialect, TSV, XLSX, JSON, YAML, NPY and NPZ, as named columns."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hecbench.errors import InputError
from hecbench.se3 import Array
from hecbench.system import files
from hecbench_datasets.reading import delimited
from hecbench_datasets.reading.delimited import all_numbers, is_number
from hecbench_datasets.reading.sources import IMAGE_SUFFIXES, YAML_SUFFIXES, json_value, text, yaml_value

TABLE_SUFFIXES = (".csv", ".txt", ".tsv", ".dat", ".xlsx", ".json", *YAML_SUFFIXES, ".npy", ".npz")
_LIST = re.compile(r"\s*(?:p|array)?[\[(]+(.*?)[\])]+\s*", re.DOTALL)
_NOTHING = frozenset({"", "nan", "none", "null", "n/a", "-"})
_MOST_COLUMNS = 10_000
_POSE_NUMBERS = 6
_MOST_UNPACKED = 100 << 20


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of one length; a column without a name has the name "".

    Attributes:
        source: names it in errors.
        names: of the columns.
        columns: numbers (N,), or texts.
    """

    source: str
    names: tuple[str, ...]
    columns: tuple[Array | list[str], ...]

    def __len__(self) -> int:
        return len(self.columns[0])

    def numbers(self) -> tuple[list[str], list[Array]]:
        """Names and values of the columns of numbers."""
        found = [(n, c) for n, c in zip(self.names, self.columns, strict=True) if isinstance(c, np.ndarray)]
        return [name for name, _ in found], [column for _, column in found]

    def texts(self) -> dict[str, list[str]]:
        """The columns of texts, by name or number."""
        pairs = zip(self.names, self.columns, strict=True)
        return {name or str(i): column for i, (name, column) in enumerate(pairs) if isinstance(column, list)}

    def rows(self, chosen: Iterable[int]) -> Table:
        """Some of the rows."""
        index = list(chosen)
        columns = (c[index] if isinstance(c, np.ndarray) else [c[i] for i in index] for c in self.columns)
        return Table(self.source, self.names, tuple(columns))


def read_table(path: Path) -> Table:
    """A table file.

    Raises:
        InputError: it holds no table, or its rows do not fit together.
    """
    suffix = path.suffix.lower()
    if suffix == ".xlsx":
        return _from_rows(_sheet(path), str(path))
    if suffix in (".npy", ".npz"):
        return _from_records(numpy_arrays(path), str(path))
    if suffix in (".json", *YAML_SUFFIXES):
        return _from_records(json_value(path) if suffix == ".json" else yaml_value(path), str(path))
    return _from_rows(delimited.cells(text(path)), str(path))


def _sheet(path: Path) -> list[list[str]]:
    try:
        import openpyxl
    except ImportError:
        raise InputError(
            f"{path}: a workbook needs pip install 'hecbench[excel]'; or save it as CSV"
        ) from None
    try:
        sheet = openpyxl.load_workbook(_unpackable(path), read_only=True, data_only=True).active
        rows = [
            ["" if cell is None else str(cell) for cell in row] for row in sheet.iter_rows(values_only=True)
        ]
    except InputError:
        raise
    except Exception as error:  # a damaged workbook raises nearly anything
        raise InputError(f"{path}: is no readable workbook ({error}); save it as CSV") from error
    return [row for row in rows if any(row)]


def numpy_arrays(path: Path) -> Any:
    """The arrays of an NPY (named "") or NPZ file."""
    try:
        loaded = np.load(_unpackable(path), allow_pickle=False)
        return (
            {"": loaded} if isinstance(loaded, np.ndarray) else {name: loaded[name] for name in loaded.files}
        )
    except InputError:
        raise
    except Exception as error:  # a damaged archive raises nearly anything
        raise InputError(
            f"{path}: is not readable NumPy data ({error}); write it with numpy.savez"
        ) from error


def _unpackable(path: Path) -> io.BytesIO:
    """The file, unless it is an archive that becomes too large when it is unpacked."""
    content = io.BytesIO(files.read_bytes(path))
    if zipfile.is_zipfile(content):
        with zipfile.ZipFile(content) as archive:
            size = sum(part.file_size for part in archive.infolist())
        if size > _MOST_UNPACKED:
            raise InputError(
                f"{path}: unpacks to {size >> 20} MB, a table has at most {_MOST_UNPACKED >> 20}; cut it"
            )
    content.seek(0)
    return content


def _from_rows(rows: list[list[str]], source: str) -> Table:
    """The table of rows of cells; the first row may be a header."""
    rows = [_expanded(row) for row in rows if row]
    if not rows:
        raise InputError(f"{source}: holds no row")
    titled = len(rows) > 1 and not any(map(is_number, rows[0])) and any(map(is_number, rows[1]))
    names, body = (rows[0], rows[1:]) if titled else ([""] * len(rows[0]), rows)
    width = len(body[0])
    for number, row in enumerate(body, 1 + titled):
        if len(row) != width:
            raise InputError(f"{source}: row {number}: {len(row)} cells after rows of {width}; complete it")
        if sum(cell.lower() in _NOTHING for cell in row) >= max(_POSE_NUMBERS, width - 2):
            raise InputError(
                f"{source}: row {number} holds no pose ({row[-1] or 'empty cells'}); delete it, and the row that "
                "belongs to it in the other table"
            )
    if titled and len(names) != width:
        names = _stretched(names, width)
    return Table(source, tuple(names), tuple(_column([row[i] for row in body]) for i in range(width)))


def _stretched(names: list[str], width: int) -> list[str]:
    """One name over a list in a cell names all its numbers; other headers that do not fit name nothing."""
    extra = width - len(names) + 1
    if extra < 1:
        return [""] * width
    lists = [
        i for i, name in enumerate(names) if re.search("pose|matrix|joint|transform|position", name.lower())
    ]
    if len(lists) != 1:
        return [""] * width
    at = lists[0]
    return [*names[:at], *(f"{names[at]}.{k}" for k in range(extra)), *names[at + 1 :]]


def _expanded(row: list[str]) -> list[str]:
    """Cells with the numbers of lists in them apart, and without brackets."""
    cells = []
    for cell in row:
        inner = _LIST.fullmatch(cell)
        words = re.split(r"[\s,;]+", re.sub(r"[\[\]()]", " ", inner[1]).strip()) if inner else [cell]
        bare = [re.sub(r"^p?[\[(]+|[\])]+$", "", word).strip() for word in words]
        cells += bare if all_numbers(bare) else [cell]
    return cells


def _from_records(content: Any, source: str) -> Table:
    """The table of a list of records, of lists by name, or of records by name."""
    for _ in range(3):  # a list may be wrapped in mappings of one or few keys
        if isinstance(content, Mapping) and not _is_columns(content):
            inner = [
                v for v in content.values() if isinstance(v, list) and v and isinstance(v[0], Mapping | list)
            ]
            if len(inner) == 1:
                content = inner[0]
            elif len(content) > 1 and all(isinstance(v, Mapping | list) for v in content.values()):
                content = [
                    {"name": str(k)} | (dict(v) if isinstance(v, Mapping) else {"pose": v})
                    for k, v in content.items()
                ]
    if isinstance(content, Mapping) and _is_columns(content):
        length = max(len(v) for v in content.values() if _is_column(v))
        content = {k: v for k, v in content.items() if _is_column(v) and len(v) == length}
        records = [{k: v[i] for k, v in content.items()} for i in range(length)]
    elif isinstance(content, list) and content:
        records = [dict(record) if isinstance(record, Mapping) else {"": record} for record in content]
    else:
        raise InputError(f"{source}: holds no list of records")
    flat = [dict(_flat(record)) for record in records]
    names = [name for name in flat[0] if all(name in row for row in flat)]
    if not names or len(names) > _MOST_COLUMNS:
        raise InputError(f"{source}: its records have no entries in common")
    return Table(source, tuple(names), tuple(_column([row[name] for row in flat]) for name in names))


def _is_column(value: Any) -> bool:
    return isinstance(value, list) or (isinstance(value, np.ndarray) and value.ndim > 0)


def _is_columns(content: Mapping[Any, Any]) -> bool:
    """Whether the values are columns: two or more of one length, or arrays."""
    lengths = [len(v) for v in content.values() if _is_column(v)]
    arrays = any(isinstance(v, np.ndarray) for v in content.values())
    return bool(lengths) and (arrays or (len(lengths) > 1 and len(set(lengths)) == 1 and lengths[0] > 1))


def _flat(value: Any, name: str = "") -> Iterable[tuple[str, Any]]:
    """Names with dots and their plain values."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, Mapping):
        for key, part in value.items():
            yield from _flat(part, f"{name}.{key}" if name else str(key))
    elif isinstance(value, list | tuple):
        numbers = np.ravel(np.array(value, object)) if value and isinstance(value[0], list | tuple) else value
        for i, part in enumerate(numbers):
            yield from _flat(part, f"{name}.{i}")
    else:
        yield name, value


def _column(cells: list[Any]) -> Array | list[str]:
    try:
        values = np.array([float(cell) for cell in cells])
        return values if np.isfinite(values).all() else [str(cell) for cell in cells]
    except (TypeError, ValueError):
        return [str(cell) for cell in cells]


def image_column(table: Table) -> list[str] | None:
    """The column of texts that names pictures."""
    for column in table.texts().values():
        if all(str(cell).lower().endswith(IMAGE_SUFFIXES) for cell in column):
            return column
    return None
