"""ChArUco boards by OpenCV: partial boards, and both layouts tried.

OpenCV 4.6 changed the layout of boards with an even number of rows (opencv#23152); whichever of the two finds
more corners is the printed one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import TargetNotSeen
from hecbench.se3 import Array
from hecbench.targets import CharucoTarget
from hecbench_plugins.detection.dictionaries import named, shown_in
from hecbench_plugins.detection.pictures import each, mirrored

Grey = NDArray[np.uint8]


def find(greys: Sequence[Grey | None], target: CharucoTarget) -> tuple[CharucoTarget, list[Array | None]]:
    """Corners (P, 2) px of each picture, NaN where not seen, and the target with the layout that fits.

    Raises:
        InputError: the dictionary is unknown, or is not the printed one (the one that fits is named).
    """
    layout, found, count = _best(greys, target, first=0)
    if count == 0:
        first = _first_id(greys, target)
        if 0 < first <= len(named(target.dictionary).bytesList) - target.columns * target.rows // 2:
            layout, found, count = _best(greys, target, first)
    if count == 0:
        raise TargetNotSeen(f"target: no image shows the ChArUco board; {_cause(greys, target)}")
    return layout, found


def _best(
    greys: Sequence[Grey | None], target: CharucoTarget, first: int
) -> tuple[CharucoTarget, list[Array | None], int]:
    """The layout that shows more corners, these, and how many; its markers are numbered from `first`."""
    layouts = [target] if target.rows % 2 else [target, replace(target, legacy=not target.legacy)]
    found = [each(greys, _corners, layout, first) for layout in layouts]
    counts = [sum(int(np.isfinite(c[:, 0]).sum()) for c in corners if c is not None) for corners in found]
    best = int(np.argmax(counts))
    return layouts[best], found[best], counts[best]


def _first_id(greys: Sequence[Grey | None], target: CharucoTarget) -> int:
    """The smallest id of the declared dictionary in the pictures; 0 when none is seen."""
    seen = [ids for ids in each(greys, _marker_ids, target.dictionary) if ids]
    return min((min(ids) for ids in seen), default=0)


def _marker_ids(grey: Grey, dictionary: str) -> list[int]:
    import cv2

    _, ids, _ = cv2.aruco.ArucoDetector(named(dictionary)).detectMarkers(grey)
    return [] if ids is None else [int(number) for number in np.ravel(ids)]


def _cause(greys: Sequence[Grey | None], target: CharucoTarget) -> str:
    """Why nothing was found, and the cure: exchanged sizes, mirrored pictures, another dictionary."""
    swapped = replace(target, columns=target.rows, rows=target.columns)
    layout, _, count = _best(greys, swapped, first=0)
    if count:
        kind = "legacy" if layout.legacy else "new"
        return (
            f"columns and rows are exchanged: a board of {swapped.columns} x {swapped.rows} squares ({kind} layout) "
            f"shows {count} corners; declare columns {swapped.columns} and rows {swapped.rows}"
        )
    seen = [ids for ids in each(greys, _marker_ids, target.dictionary) if ids]
    if seen:
        numbers = sorted({number for ids in seen for number in ids})
        return (
            f"up to {max(map(len, seen))} markers of {target.dictionary}, ids {numbers[0]} to {numbers[-1]}, are seen "
            f"in {len(seen)} images, but not as a board of {target.columns} x {target.rows} squares: count them"
        )
    if note := mirrored(greys, _marker_ids, target.dictionary):
        return note.removeprefix("; ")
    return shown_in(greys, target.dictionary)


def board_of(target: CharucoTarget, first: int = 0) -> Any:
    """OpenCV's object for the board, its markers numbered from `first`; an `InputError` for an unknown dictionary."""
    import cv2

    size = target.columns, target.rows
    dictionary, ids = named(target.dictionary), None
    if first:
        ids = first + np.arange(target.columns * target.rows // 2, dtype=np.int32)
    board = cv2.aruco.CharucoBoard(size, target.square_m, target.marker_m, dictionary, ids)
    board.setLegacyPattern(target.legacy)
    return board


def _corners(grey: Grey, target: CharucoTarget, first: int) -> Array | None:
    import cv2

    points, ids, _, _ = cv2.aruco.CharucoDetector(board_of(target, first)).detectBoard(grey)
    if ids is None or len(ids) == 0:
        return None
    corners = np.full((len(target.points_m), 2), np.nan)
    corners[np.ravel(ids)] = np.asarray(points, float).reshape(-1, 2)
    return corners
