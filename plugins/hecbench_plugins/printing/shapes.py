"""The black shapes of a target, in millimetres: x to the right and y up from the lower left corner of the pattern."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError
from hecbench.targets import (
    AprilGridTarget,
    AprilTagTarget,
    ArucoGridTarget,
    ArucoTarget,
    CharucoTarget,
    ChessboardTarget,
    PointsTarget,
    Target,
    grid_shape,
)
from hecbench_plugins.detection.charuco import board_of
from hecbench_plugins.detection.dictionaries import named

_DOT, _FIRST_DOT = 0.5, 0.75
"""Diameter over spacing of the dots of a circle grid, and of the first one, which says where the grid begins."""
_FAMILIES = {"tag36h11": "36h11", "tag25h9": "25h9", "tag16h5": "16h5"}


@dataclass(frozen=True)
class Rectangle:
    """A black rectangle by its lower left corner and size, mm."""

    x: float
    y: float
    width: float
    height: float


@dataclass(frozen=True)
class Dot:
    """A black disc by its centre and diameter, mm."""

    x: float
    y: float
    diameter: float


@dataclass(frozen=True)
class Pattern:
    """What is printed: the shapes, the size of all, and the white that must stay around them, mm."""

    shapes: tuple[Rectangle | Dot, ...]
    width: float
    height: float
    quiet: float


def pattern(target: Target) -> Pattern:
    """The shapes of a target.

    Raises:
        InputError: the target is a set of points that is no grid, or its tag family or dictionary cannot be drawn.
    """
    match target:
        case ChessboardTarget():
            return _chessboard(target)
        case CharucoTarget():
            return _charuco(target)
        case AprilTagTarget():
            return _tag(target)
        case ArucoTarget():
            return _markers(
                target.dictionary, [target.id], (1, 1), 1e3 * target.size_m, 1e3 * target.size_m, 1
            )
        case ArucoGridTarget():
            pitch = 1e3 * (target.marker_m + target.gap_m)
            ids = list(range(target.first_id, target.first_id + target.marker_count))
            size = target.columns, target.rows
            return _markers(target.dictionary, ids, size, 1e3 * target.marker_m, pitch, 1)
        case AprilGridTarget():
            return _aprilgrid(target)
        case PointsTarget():
            return _dots(target)
    raise InputError(f"target.kind: '{target.kind}' cannot be printed")


def _chessboard(target: ChessboardTarget) -> Pattern:
    side = 1e3 * target.square_m
    columns, rows = target.columns + 1, target.rows + 1
    black = [(i, j) for j in range(rows) for i in range(columns) if (i + j) % 2 == 0]
    squares = tuple(Rectangle(i * side, (rows - 1 - j) * side, side, side) for i, j in black)
    return Pattern(squares, columns * side, rows * side, side)


def _charuco(target: CharucoTarget) -> Pattern:
    board = board_of(target)
    bits = board.getDictionary().markerSize + 2
    side, marker = 1e3 * target.square_m, 1e3 * target.marker_m
    black = [
        (i, j)
        for j in range(target.rows)
        for i in range(target.columns)
        if (i + j) % 2 == _first_black(target)
    ]
    shapes = [Rectangle(i * side, (target.rows - 1 - j) * side, side, side) for i, j in black]
    white = [(i, j) for j in range(target.rows) for i in range(target.columns) if (i, j) not in set(black)]
    margin = (side - marker) / 2
    for (i, j), marker_id in zip(white, board.getIds().ravel().tolist(), strict=True):
        image = board.getDictionary().generateImageMarker(marker_id, bits)
        corner = i * side + margin, (target.rows - 1 - j) * side + margin
        shapes += _bits(image, corner, marker / bits)
    return Pattern(tuple(shapes), target.columns * side, target.rows * side, side / 2)


def _first_black(target: CharucoTarget) -> int:
    """The parity of the black squares: in the layout of OpenCV before 4.6 a board of even rows begins with a marker."""
    return 1 if target.legacy and target.rows % 2 == 0 else 0


def _tag(target: AprilTagTarget) -> Pattern:
    import cv2

    if target.family not in _FAMILIES:
        raise InputError(
            f"target.family: '{target.family}' cannot be drawn; choose one of {', '.join(_FAMILIES)}"
        )
    dictionary = cv2.aruco.getPredefinedDictionary(
        getattr(cv2.aruco, f"DICT_APRILTAG_{_FAMILIES[target.family]}")
    )
    count = len(dictionary.bytesList)
    if not 0 <= target.id < count:
        raise InputError(f"target.id: {target.id} is not in {target.family}; its ids are 0 to {count - 1}")
    bits = dictionary.markerSize + 2
    image = np.rot90(dictionary.generateImageMarker(target.id, bits), 2)  # OpenCV's tags stand upside down
    side = 1e3 * target.size_m
    return Pattern(tuple(_bits(image, (0.0, 0.0), side / bits)), side, side, side / bits)


def _markers(
    dictionary: str, ids: list[int], size: tuple[int, int], side: float, pitch: float, border: int
) -> Pattern:
    """Markers row by row from the top left; `border` is their black border in cells."""
    known = named(dictionary)
    count, cells = len(known.bytesList), known.markerSize + 2 * border
    if ids[-1] >= count:
        raise InputError(
            f"target: id {ids[-1]} is not in {dictionary}; its ids are 0 to {count - 1}: choose a larger dictionary"
        )
    columns, rows = size
    shapes: list[Rectangle] = []
    for place, number in enumerate(ids):
        row, column = divmod(place, columns)
        corner = column * pitch, (rows - 1 - row) * pitch
        shapes += _bits(known.generateImageMarker(number, cells, borderBits=border), corner, side / cells)
    return Pattern(
        tuple(shapes),
        side + (columns - 1) * pitch,
        side + (rows - 1) * pitch,
        max(side / cells, pitch - side),
    )


def _aprilgrid(target: AprilGridTarget) -> Pattern:
    """As Kalibr prints it: borders of two cells, rows from the bottom, and black squares where four tags meet."""
    side = 1e3 * target.tag_m
    gap, pitch = side * target.spacing, side * (1 + target.spacing)
    ids = np.arange(target.first_id, target.first_id + target.marker_count).reshape(
        target.rows, target.columns
    )
    size = target.columns, target.rows
    turned = _markers(target.dictionary, ids[:, ::-1].ravel().tolist(), size, side, pitch, 2)
    tags = tuple(  # OpenCV's tags stand upside down: the whole page is turned
        Rectangle(gap + turned.width - r.x - r.width, gap + turned.height - r.y - r.height, r.width, r.height)
        for r in turned.shapes
        if isinstance(r, Rectangle)
    )
    squares = tuple(
        Rectangle(i * pitch, j * pitch, gap, gap)
        for j in range(target.rows + 1)
        for i in range(target.columns + 1)
    )
    return Pattern((*tags, *squares), turned.width + 2 * gap, turned.height + 2 * gap, gap)


def _dots(target: PointsTarget) -> Pattern:
    shape = grid_shape(target.points_m)
    if shape is None:
        raise InputError(
            "target.points_m: is no grid row by row with even spacing; only grids of dots are printed"
        )
    columns, rows = shape
    spacing = 1e3 * float(target.points_m[1, 0] - target.points_m[0, 0])
    dots = [
        Dot(
            (i + 0.5) * spacing,
            (rows - 1 - j + 0.5) * spacing,
            spacing * (_FIRST_DOT if (i, j) == (0, 0) else _DOT),
        )
        for j in range(rows)
        for i in range(columns)
    ]
    return Pattern(tuple(dots), columns * spacing, rows * spacing, spacing / 2)


def _bits(image: NDArray[np.uint8], corner: tuple[float, float], cell: float) -> list[Rectangle]:
    """The black runs of an image with one pixel per cell, so that no hairline parts neighbouring cells."""
    shapes = []
    for row, line in enumerate(image):
        edges = np.flatnonzero(np.diff(np.concatenate([[255], line, [255]]).astype(int)))
        for start, stop in edges.reshape(-1, 2).tolist():
            y = corner[1] + (len(image) - 1 - row) * cell
            shapes.append(Rectangle(corner[0] + start * cell, y, (stop - start) * cell, cell))
    return shapes
