"""Calibration targets as points in their own frame (m); a recording's `corners_px` has one row per point."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from hecbench.errors import InputError
from hecbench.se3 import Array

ANY_TAG = -1
"""The AprilTag id that stands for the only tag of its family in view; detection puts the true one there."""


_LARGEST_GRID = 1000


class Target:
    """Any target: its `kind` as recordings spell it, and its points (P, 3) m."""

    kind: ClassVar[str]

    @cached_property
    def points_m(self) -> Array:
        """(P, 3) m in the target's frame."""
        raise NotImplementedError

    @property
    def is_planar(self) -> bool:
        """Whether all points have z = 0."""
        return bool((self.points_m[:, 2] == 0).all())


@dataclass(frozen=True)
class PointsTarget(Target):
    """Points given one by one; `coordinates_m` is a tuple of (x, y, z)."""

    kind: ClassVar[str] = "points"
    coordinates_m: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        if not self.coordinates_m or any(len(point) != 3 for point in self.coordinates_m):
            raise InputError("target.points_m: expected a non-empty list of [x, y, z]")
        if not np.isfinite(self.points_m).all():
            raise InputError("target.points_m: holds a number that is not finite")

    @cached_property
    def points_m(self) -> Array:
        """(P, 3) m in the target's frame."""
        return np.array(self.coordinates_m, float)

    @classmethod
    def of(cls, points_m: ArrayLike) -> PointsTarget:
        """From an array (P, 3) m."""
        return cls(tuple(tuple(point) for point in np.asarray(points_m, float).tolist()))


@dataclass(frozen=True)
class ChessboardTarget(Target):
    """Inner corners row by row, x along columns, z = 0."""

    kind: ClassVar[str] = "chessboard"
    columns: int
    rows: int
    square_m: float

    def __post_init__(self) -> None:
        _grid_size("columns", self.columns)
        _grid_size("rows", self.rows)
        _positive("square_m", self.square_m)

    @cached_property
    def points_m(self) -> Array:
        """(columns * rows, 3) m in the board's frame."""
        return _grid(self.columns, self.rows, self.square_m)


@dataclass(frozen=True)
class CharucoTarget(Target):
    """Inner corners of a board of columns x rows squares, row by row, x along columns, z = 0."""

    kind: ClassVar[str] = "charuco"
    columns: int
    rows: int
    square_m: float
    marker_m: float
    dictionary: str
    legacy: bool = False

    def __post_init__(self) -> None:
        _grid_size("columns", self.columns)
        _grid_size("rows", self.rows)
        _positive("square_m", self.square_m)
        _positive("marker_m", self.marker_m)
        if self.marker_m >= self.square_m:
            raise InputError(
                f"target.marker_m: {self.marker_m} must be smaller than square_m {self.square_m}"
            )

    @cached_property
    def points_m(self) -> Array:
        """((columns - 1) * (rows - 1), 3) m: the first inner corner lies at (square_m, square_m, 0)."""
        inner = _grid(self.columns - 1, self.rows - 1, self.square_m)
        return np.add(inner, [self.square_m, self.square_m, 0.0])


@dataclass(frozen=True)
class AprilTagTarget(Target):
    """The official tag frame (x right, y down, z into the tag); corners from bottom-left to top-left."""

    kind: ClassVar[str] = "apriltag"
    family: str
    id: int
    size_m: float

    def __post_init__(self) -> None:
        _positive("size_m", self.size_m)

    @cached_property
    def points_m(self) -> Array:
        """(4, 3) m in the tag's frame."""
        half = self.size_m / 2
        return np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])


class MarkersTarget(Target):
    """Square markers of a dictionary, with four points each, in the order of their ids from `first_id` on."""

    dictionary: str
    first_id: int

    @property
    def marker_count(self) -> int:
        """How many markers there are."""
        return len(self.points_m) // 4


@dataclass(frozen=True)
class ArucoTarget(MarkersTarget):
    """One ArUco marker: x right, y up, z towards the viewer; corners from top-left, clockwise, as OpenCV lists them.

    `size_m` is the side of the black square.
    """

    kind: ClassVar[str] = "aruco"
    dictionary: str
    id: int
    size_m: float

    def __post_init__(self) -> None:
        _id("id", self.id)
        _positive("size_m", self.size_m)

    @property
    def first_id(self) -> int:  # type: ignore[override]
        """The marker's id."""
        return self.id

    @cached_property
    def points_m(self) -> Array:
        """(4, 3) m in the marker's frame."""
        half = self.size_m / 2
        return np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])


@dataclass(frozen=True)
class ArucoGridTarget(MarkersTarget):
    """OpenCV's GridBoard: ids row by row from the top left, x right, y down, z into the board, origin at its corner.

    `marker_m` is the side of a black square, `gap_m` the white between two. Each marker has its corners from top-left,
    clockwise.
    """

    kind: ClassVar[str] = "aruco_grid"
    columns: int
    rows: int
    marker_m: float
    gap_m: float
    dictionary: str
    first_id: int = 0

    def __post_init__(self) -> None:
        _marker_grid(self.columns, self.rows)
        _positive("marker_m", self.marker_m)
        _positive("gap_m", self.gap_m)
        _id("first_id", self.first_id)

    @cached_property
    def points_m(self) -> Array:
        """(4 columns rows, 3) m in the board's frame."""
        return _squares(self.columns, self.rows, self.marker_m, self.marker_m + self.gap_m)


@dataclass(frozen=True)
class AprilGridTarget(MarkersTarget):
    """Kalibr's grid of AprilTags: ids row by row from the bottom left, x right, y up, origin at its corner.

    `tag_m` is the side of a black square, `spacing` the white between two over it, as Kalibr's `tagSize` and
    `tagSpacing`. Each tag has its corners from bottom-left, counter-clockwise.
    """

    kind: ClassVar[str] = "aprilgrid"
    columns: int
    rows: int
    tag_m: float
    spacing: float
    family: str = "tag36h11"
    first_id: int = 0

    def __post_init__(self) -> None:
        _marker_grid(self.columns, self.rows)
        _positive("tag_m", self.tag_m)
        if not (np.isfinite(self.spacing) and 0 < self.spacing < 10):
            raise InputError(
                f"target.spacing: {self.spacing} is not the ratio of the white between two tags to a tag, as 0.3"
            )
        _id("first_id", self.first_id)
        if not self.family.startswith("tag"):
            raise InputError(f"target.family: '{self.family}' is not a tag family; use tag36h11")

    @property
    def dictionary(self) -> str:  # type: ignore[override]
        """The family as OpenCV names it."""
        return f"APRILTAG_{self.family.removeprefix('tag')}"

    @cached_property
    def points_m(self) -> Array:
        """(4 columns rows, 3) m in the grid's frame."""
        return _squares(self.columns, self.rows, self.tag_m, self.tag_m * (1 + self.spacing))


DECLARED = (ChessboardTarget, CharucoTarget, AprilTagTarget, ArucoTarget, ArucoGridTarget, AprilGridTarget)
"""The targets that are described by their fields, as files name them, rather than point by point."""


def grid_shape(points_m: Array) -> tuple[int, int] | None:
    """(columns, rows) of points (P, 3) m that form a grid row by row, x along the columns, z = 0."""
    if len(points_m) < 4 or points_m[:, 2].any():
        return None
    columns = int((np.abs(points_m[:, 1] - points_m[0, 1]) < 1e-9).sum())
    rows, rest = divmod(len(points_m), columns)
    if rest or columns < 2 or rows < 2:
        return None
    spacing = points_m[1, 0] - points_m[0, 0]
    y, x = np.mgrid[:rows, :columns]
    expected = np.stack([x.ravel(), y.ravel()], 1) * spacing + points_m[0, :2]
    return (columns, rows) if spacing > 0 and np.allclose(points_m[:, :2], expected, atol=1e-6) else None


def _grid(columns: int, rows: int, spacing_m: float) -> Array:
    y, x = np.mgrid[:rows, :columns]
    return np.stack([x.ravel(), y.ravel(), np.zeros(rows * columns)], 1) * spacing_m


def _squares(columns: int, rows: int, side_m: float, pitch_m: float) -> Array:
    """(4 columns rows, 3) m: the corners of each square around it, from the one nearest to the origin along x."""
    corners = side_m * np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    return np.asarray((_grid(columns, rows, pitch_m)[:, None] + corners).reshape(-1, 3))


def _positive(name: str, value: float) -> None:
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"target.{name}: {value} is not a positive length in metres")


def _id(name: str, value: int) -> None:
    if value < 0:
        raise InputError(f"target.{name}: {value} is negative; ids begin at 0")


def _marker_grid(columns: int, rows: int) -> None:
    for name, value in (("columns", columns), ("rows", rows)):
        if not 1 <= value <= _LARGEST_GRID:
            raise InputError(f"target.{name}: {value} is not within 1 to {_LARGEST_GRID}")


def _grid_size(name: str, value: int) -> None:
    if not 2 <= value <= _LARGEST_GRID:
        raise InputError(f"target.{name}: {value} is not within 2 to {_LARGEST_GRID}")
