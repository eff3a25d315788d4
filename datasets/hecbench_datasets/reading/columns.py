"""What the columns of a table are, by the words over them or by their numbers: poses, joints, stamps, pictures."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hecbench import se3
from hecbench.se3 import Array
from hecbench_datasets.reading.tables import Table, image_column

ROBOT_WORDS = re.compile(
    r"robot|flange|gripper|hand(?!eye)|effector|tool|base|tcp|arm|\bee|ee\b|o_t_ee", re.IGNORECASE
)
TARGET_WORDS = re.compile(r"cam|target|marker|tag|board|track|eye|object|sensor|optical", re.IGNORECASE)
_STAMP = re.compile(
    r"^(time|stamp|timestamp|t|secs?|time_?stamp_?\w*|\w*_time|\w*stamp)(_(s|ms|us|ns|sec))?$"
)
_JOINT = re.compile(
    r"^(?:q|j|joint|axis|theta|qpos|joints?_?(?:position|angle|value|pos)?s?)_?(\d+)$|_joint$|joint_?\d+$"
)
_POSITION = re.compile(r"^(position|translation|pos|trans|xyz|t|p|tvec)_(\d)$")
_TURN = re.compile(r"^(orientation|quaternion|quat|rotation|rot|rpy|rotvec|rvec|euler|q|r)_(\d)$")
_WHOLE = re.compile(r"_?(\d+)$")
_GENERIC = {
    "pose",
    "position",
    "orientation",
    "translation",
    "rotation",
    "transform",
    "pos",
    "rot",
    "quat",
    "quaternion",
}
_GENERIC |= {"q", "r", "t", "p", "rpy", "rotvec", "rvec", "tvec", "xyz", "euler", "angle", "matrix"}
_UNIT_WORDS = {
    "mm": "mm",
    "cm": "cm",
    "m": "m",
    "deg": "deg",
    "degree": "deg",
    "degrees": "deg",
    "rad": "rad",
}
_TURNS: dict[tuple[str, ...], tuple[str, ...]] = {
    ("qx", "qy", "qz", "qw"): ("quat_xyzw",),
    ("roll", "pitch", "yaw"): ("euler_xyz",),
    ("a", "b", "c"): ("euler_ZYX", "euler_ZYZ"),
    ("w", "p", "r"): ("euler_xyz",),
    ("o", "a", "t"): ("euler_ZYZ",),
    ("u", "v", "w"): ("euler_ZYX",),
    ("rx", "ry", "rz"): ("rotvec", "euler_xyz", "euler_XYZ", "euler_ZYX"),
    ("alpha", "beta", "gamma"): ("euler_XYZ", "euler_ZYX"),
}
"""Columns of a rotation and what their words usually mean: Doosan calls its ZYZ angles A B C, as KUKA its ZYX ones."""
_ALIASES = {"tx": "x", "ty": "y", "tz": "z", "px": "x", "py": "y", "pz": "z"}
_ALIASES |= {"t1": "x", "t2": "y", "t3": "z"}
_LENGTHS = (6, 7, 12, 16)


@dataclass(frozen=True, eq=False)
class Poses:
    """One stream of poses in a table.

    Attributes:
        name: the words that its columns share.
        numbers: (N, 6 | 7 | 12 | 16), position first.
        rotations: what the words over the columns may mean; none where there are none.
        unit: of lengths, where the words say it.
    """

    name: str
    numbers: Array
    rotations: tuple[str, ...] = ()
    unit: str | None = None


@dataclass(frozen=True, eq=False)
class Columns:
    """What was recognised in one table."""

    source: str
    poses: list[Poses] = field(default_factory=list)
    joints: Array | None = None
    joint_names: tuple[str, ...] = ()
    stamps: Array | None = None
    images: list[str] | None = None
    rest: tuple[str, ...] = ()

    @property
    def found(self) -> str:
        """In words, for messages."""
        parts = [
            f"poses of {p.numbers.shape[1]} numbers{f' ({p.name})' if p.name else ''}" for p in self.poses
        ]
        parts += [f"{self.joints.shape[1]} joints"] if self.joints is not None else []
        parts += ["stamps"] if self.stamps is not None else []
        parts += ["names of pictures"] if self.images is not None else []
        return ", ".join(parts) or f"columns {', '.join(self.rest[:12])}"


def recognise(table: Table) -> list[Columns]:
    """What each stream of a table is; one table may hold the rows of two, marked by a word."""
    parts = _by_word(table) or [("", table)]
    return [_columns(part, name) for name, part in parts]


def _by_word(table: Table) -> list[tuple[str, Table]]:
    """The table in two where a column of texts names the robot in half of the rows and the target in the others."""
    for column in table.texts().values():
        words = sorted(set(column))
        robot = [w for w in words if ROBOT_WORDS.search(w) and not TARGET_WORDS.search(w)]
        target = [w for w in words if TARGET_WORDS.search(w)]
        if len(words) == 2 and len(robot) == len(target) == 1 and column.count(robot[0]) * 2 == len(column):
            return [
                (w, table.rows(i for i, cell in enumerate(column) if cell == w))
                for w in (robot[0], target[0])
            ]
    return []


def _columns(table: Table, name: str) -> Columns:
    names, values = table.numbers()
    images = image_column(table)
    kept, stamps = [], None
    for title, column in zip(names, values, strict=True):
        key = _plain(title)[0]
        if _STAMP.match(key) and (len(table) < 2 or (np.diff(column) >= 0).all()) and np.ptp(column) > 0:
            stamps = column
        elif not _counts(column, title):
            kept.append((title, column))
    if not kept:
        return Columns(table.source, stamps=stamps, images=images, rest=tuple(names))
    if all(title == "" or _WHOLE.fullmatch(title.lstrip(".")) for title, _ in kept):
        return _unnamed(table.source, name, [column for _, column in kept], stamps, images)
    return _named(table.source, name, kept, stamps, images)


def _counts(column: Array, title: str) -> bool:
    """A counter, which says nothing: whole numbers one apart, or what the header calls one."""
    steps = np.diff(column)
    called = _plain(title)[0] in (
        "id",
        "i",
        "index",
        "idx",
        "nr",
        "no",
        "n",
        "sample",
        "frame",
        "number",
        "count",
        "",
    )
    return (
        called
        and len(column) > 2
        and bool((column == np.round(column)).all() and (steps == steps[0]).all() and steps[0])
    )


def _plain(title: str) -> tuple[str, str | None, str | None]:
    """A header in small letters with single underscores, and the units of length and angle it names."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", title).lower()
    parts = [part for part in re.split(r"[^a-z0-9]+", words) if part]
    unit = next((_UNIT_WORDS[part] for part in parts[1:] if part in ("mm", "cm", "m")), None)
    angle = next(
        (_UNIT_WORDS[part] for part in parts[1:] if part in _UNIT_WORDS and part not in ("mm", "cm", "m")),
        None,
    )
    kept = [part for i, part in enumerate(parts) if i == 0 or part not in _UNIT_WORDS]
    return "_".join(kept), unit, angle


def _unnamed(
    source: str, name: str, values: list[Array], stamps: Array | None, images: list[str] | None
) -> Columns:
    rows = np.column_stack(values)
    if rows.shape[1] == 4 and (stacked := _stacked(rows)) is not None:
        rows = stacked
    width = rows.shape[1]
    if width not in _LENGTHS and width - 1 in _LENGTHS and (np.diff(rows[:, 0]) > 0).all():
        rows, stamps, width = rows[:, 1:], rows[:, 0], width - 1
    if width == 12 and not _is_matrices(rows):
        widths = [6, 6]
    else:
        widths = {13: _six_and_seven(rows), 14: [7, 7], 24: [12, 12], 32: [16, 16]}.get(width, [width])
    if any(part not in _LENGTHS for part in widths):
        return Columns(source, stamps=stamps, images=images, rest=(f"{width} numbers a row",))
    parts = np.split(rows, np.cumsum(widths)[:-1], axis=1)
    words = [name] if len(parts) == 1 else ["robot (first columns)", "target (last columns)"]
    return Columns(
        source, [Poses(w, p) for w, p in zip(words, parts, strict=True)], stamps=stamps, images=images
    )


def _six_and_seven(rows: Array) -> list[int]:
    return [6, 7] if np.allclose(np.linalg.norm(rows[:, 9:], axis=1), 1, atol=1e-2) else [7, 6]


def _is_matrices(rows: Array) -> bool:
    parts = (rows.reshape(-1, 3, 4)[:, :, :3], rows[:, :9].reshape(-1, 3, 3), rows[:, 3:].reshape(-1, 3, 3))
    return any(se3.is_transform(se3.make(part, np.zeros(3)), 1e-2).all() for part in parts)


def _stacked(rows: Array) -> Array | None:
    """(N, 12 | 16) of matrices written one below the other, or None."""
    if len(rows) % 4 == 0 and np.allclose(rows[3::4], [0, 0, 0, 1]):
        return rows.reshape(-1, 16)
    if len(rows) % 3 == 0 and _is_matrices(rows.reshape(-1, 12)):
        return rows.reshape(-1, 12)
    return None


def _named(
    source: str, name: str, kept: Sequence[tuple[str, Array]], stamps: Array | None, images: list[str] | None
) -> Columns:
    groups: dict[str, dict[str, tuple[str, Array]]] = {}
    units: dict[str, str] = {}
    for title, column in kept:
        key, unit, angle = _plain(title)
        group, axis = _axis(key)
        groups.setdefault(group, {})[axis] = title, np.deg2rad(column) if angle == "deg" else column
        units |= {group: unit} if unit else {}
    poses, joints, rest = [], [], []
    for group, axes in groups.items():
        found = _pose({axis: column for axis, (_, column) in axes.items()})
        if found is None:
            joints += [pair for pair in axes.values() if _JOINT.search(_plain(pair[0])[0])]
            rest += [title for title, _ in axes.values()]
        else:
            poses.append(Poses(" ".join(filter(None, (name, group))), *found, units.get(group)))
    return Columns(
        source,
        poses,
        joints=np.column_stack([c for _, c in joints]) if len(joints) > 2 else None,
        joint_names=tuple(title for title, _ in joints),
        stamps=stamps,
        images=images,
        rest=tuple(rest),
    )


def _axis(key: str) -> tuple[str, str]:
    """The group that a column belongs to, and which number of its pose it is."""
    words = key.split("_")
    for take in (2, 1):
        tail, head = "_".join(words[-take:]), [w for w in words[:-take] if w not in _GENERIC]
        if match := _POSITION.match(tail):
            return "_".join(head), "xyz"[int(match[2])] if int(match[2]) < 3 else tail
        if match := _TURN.match(tail):
            return "_".join(head), f"turn{match[2]}"
    last, head = words[-1], words[:-1]
    if last in ("x", "y", "z", "w") and head and head[-1] in ("orientation", "quaternion", "quat", "q"):
        last = f"q{last}"
    elif last in ("x", "y", "z") and head and head[-1] in ("r", "rot", "rotation", "rotvec", "rvec", "euler"):
        last = f"r{last}"
    head = [word for word in head if word not in _GENERIC]
    return "_".join(head), _ALIASES.get(last, last)


def _pose(axes: dict[str, Array]) -> tuple[Array, tuple[str, ...]] | None:
    """The pose numbers (N, 6 | 7 | 12 | 16) of named columns, and what their words mean."""
    whole = sorted((int(axis), column) for axis, column in axes.items() if axis.isdecimal())
    if len(whole) in _LENGTHS and len(whole) == len(axes):
        return np.column_stack([column for _, column in whole]), ()
    for first in (0, 1):
        numbers = range(first, first + 3)
        matrix = [axes.get(f"{name}{i}{j}") for name in "mrt" for i in numbers for j in (*numbers, first + 3)]
        given = [column for column in matrix if column is not None]
        if len(given) == 12:
            return np.column_stack(given), ()
        if len(given) == 9 and all(axis in axes for axis in "xyz"):
            return np.column_stack([*given, *(axes[axis] for axis in "xyz")]), ()
    if not all(axis in axes for axis in "xyz"):
        return None
    position = [axes[axis] for axis in "xyz"]
    turns = [axes[f"turn{i}"] for i in range(9) if f"turn{i}" in axes]
    if len(turns) in (3, 4):
        return np.column_stack([*position, *turns]), ()
    if len(turns) == 9:
        rows = np.concatenate([np.reshape(turns, (3, 3, -1)), np.reshape(position, (3, 1, -1))], axis=1)
        return np.moveaxis(rows, -1, 0).reshape(-1, 12), ()
    if all(f"q{i}" in axes for i in range(1, 5)) and "q5" not in axes:
        return np.column_stack([*position, *(axes[f"q{i}"] for i in range(1, 5))]), ("quat_wxyz",)
    for words, meaning in _TURNS.items():
        if all(word in axes for word in words):
            return np.column_stack([*position, *(axes[word] for word in words)]), meaning
    return None
