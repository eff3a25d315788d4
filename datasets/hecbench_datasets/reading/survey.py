"""What lies in a folder that is laid out in nobody's format: tables, files of one pose each, pictures."""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hecbench.errors import InputError
from hecbench.exchange.conventions import HINTS_NAME
from hecbench_datasets.reading.columns import Columns, Poses, recognise
from hecbench_datasets.reading.sources import IMAGE_SUFFIXES, natural
from hecbench_datasets.reading.tables import TABLE_SUFFIXES, Table, read_table

_NO_TABLE = re.compile(
    r"readme|license|requirements|intrinsic|camera_?info|calib|^k$|distort|dist_?coeff|config", re.IGNORECASE
)
_NO_PICTURE = re.compile(r"mask|depth|segm|label", re.IGNORECASE)
_DEPTH = re.compile(r"depth", re.IGNORECASE)
_DEEPEST = 4
_MOST_FILES = 20_000
_MOST_TABLES = 50
_MOST_SAID = 5
_SERIES = 3
"""Files that differ in their number only are one table from so many on."""


@dataclass(frozen=True)
class Survey:
    """The usable files of a folder.

    Attributes:
        path: the folder, or the one table.
        files: all of them.
        streams: what was recognised in its tables.
        pictures: by folder, in natural order.
        depths: pictures of depth, in natural order.
        faults: why files that look like tables are none.
    """

    path: Path
    files: list[Path] = field(default_factory=list)
    streams: list[Columns] = field(default_factory=list)
    pictures: dict[Path, list[Path]] = field(default_factory=dict)
    depths: list[Path] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)

    @property
    def found(self) -> str:
        """In words, for messages."""
        shown = [f"{stream.source} ({stream.found})" for stream in self.streams]
        shown += [f"{len(files)} pictures in {folder.name}/" for folder, files in self.pictures.items()]
        said = "; ".join(shown[:_MOST_SAID] + self.faults[:2]) or "neither tables nor pictures"
        return said.replace(f"{self.path}/", "")


def survey(path: Path) -> Survey:
    """Look at every file of a folder down to four levels, or at one table."""
    files = [path] if path.is_file() else _below(path)
    pictures: dict[Path, list[Path]] = defaultdict(list)
    for file in files:
        if file.suffix.lower() in IMAGE_SUFFIXES and not _NO_PICTURE.search(str(file.relative_to(path))):
            pictures[file.parent].append(file)
    depths = [
        f for f in files if f.suffix.lower() in IMAGE_SUFFIXES and _DEPTH.search(str(f.relative_to(path)))
    ]
    found = Survey(path, files, pictures=dict(pictures), depths=depths)
    tables = [f for f in files if f.suffix.lower() in TABLE_SUFFIXES and not _NO_TABLE.search(f.stem)]
    for series in _series(tables)[:_MOST_TABLES]:
        try:
            table = read_table(series[0]) if len(series) == 1 else _one_pose_each(series)
            found.streams.extend(recognise(table))
        except InputError as error:
            found.faults.append(str(error))
    if len(found.streams) == 1 and len(found.streams[0].poses) == 1 and not pictures:
        found.streams[:] = _taking_turns(found.streams[0])
    return found


def _taking_turns(columns: Columns) -> list[Columns]:
    """Two streams of one table whose rows take turns: even and odd ones are far apart; else the one."""
    position = columns.poses[0].numbers[:, [3, 7, 11] if columns.poses[0].numbers.shape[1] > 7 else [0, 1, 2]]
    even, odd = position[0::2], position[1::2]
    if len(even) != len(odd) or len(even) < 5:
        return [columns]
    apart = np.linalg.norm(even.mean(0) - odd.mean(0))
    if apart < 3 * max(np.linalg.norm(even.std(0)), np.linalg.norm(odd.std(0))):
        return [columns]
    poses = columns.poses[0]
    return [
        Columns(columns.source, [Poses(name, poses.numbers[k::2], poses.rotations, poses.unit)])
        for k, name in enumerate(("robot (odd rows)", "target (even rows)"))
    ]


def _below(folder: Path) -> list[Path]:
    """The folder's files in natural order, those of its own folders after them."""
    files: list[Path] = []
    waiting = [(folder, 1)]
    while waiting and len(files) < _MOST_FILES:
        place, level = waiting.pop(0)
        try:
            entries = sorted(place.iterdir(), key=natural)
        except OSError as error:
            raise InputError(
                f"{place}: cannot be read ({error.strerror}); check the path and its permissions"
            ) from error
        files += [entry for entry in entries if entry.is_file() and entry.name != HINTS_NAME]
        if level < _DEEPEST:
            waiting += [(e, level + 1) for e in entries if e.is_dir() and not e.name.startswith(".")]
    return files


def _series(files: list[Path]) -> list[list[Path]]:
    """The files, those that differ in a number of their name together."""
    groups: dict[tuple[Path, str], list[Path]] = defaultdict(list)
    for file in files:
        groups[file.parent, re.sub(r"\d+", "#", file.name)].append(file)
    series = [[group] if len(group) >= _SERIES else [[file] for file in group] for group in groups.values()]
    return [files for group in series for files in group]


def _one_pose_each(files: list[Path]) -> Table:
    """The table of files that hold one row, or one matrix, each."""
    rows = []
    for file in files:
        table = read_table(file)
        _, columns = table.numbers()
        rows.append(np.column_stack(columns).ravel() if columns else np.zeros(0))
        names = table.names if len(table) == 1 and len(columns) == len(table.names) else ()
    if len({len(row) for row in rows}) != 1 or not len(rows[0]):
        raise InputError(f"{files[0]}: and its {len(files) - 1} neighbours do not hold one pose each")
    columns = list(np.array(rows).T)
    source = files[0].parent / re.sub(r"\d+", "*", files[0].name)
    return Table(str(source), names or ("",) * len(columns), tuple(columns))
