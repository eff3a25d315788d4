"""What target pictures show when nobody says: asked of the detectors, with the smallest of assumptions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hecbench.system import pictures

_ASKED = 5
"""Pictures looked at, evenly spread."""
_FAMILIES = {
    "DICT_APRILTAG_36h11": "tag36h11",
    "DICT_APRILTAG_25h9": "tag25h9",
}
_DICTIONARIES = (
    *(f"DICT_{bits}X{bits}_250" for bits in (4, 5, 6, 7)),
    "DICT_ARUCO_ORIGINAL",
    *_FAMILIES,
)
_KALIBR_BORDER = 2
"""Cells of the black border of Kalibr's tags; all others have one."""
_READINGS = (*((name, 1) for name in _DICTIONARIES), ("DICT_APRILTAG_36h11", _KALIBR_BORDER))
_BOARD_FROM = 4
"""Markers in one picture that make a board rather than a few tags."""


def seen_target(images: Sequence[Path]) -> str:
    """What to write for the target, as far as the pictures show it: the first words of a cure."""
    chosen = [
        images[i] for i in np.unique(np.linspace(0, len(images) - 1, min(len(images), _ASKED)).astype(int))
    ]
    greys = [pictures.image(image, str(image)).mean(2).astype(np.uint8) for image in chosen]
    return (
        _markers(greys)
        or _chessboard(greys)
        or "no target was recognised in them: write target: {kind: chessboard, columns: C, rows: R, square_m: S} or "
        "another kind"
    )


def _chessboard(greys: Sequence[NDArray[np.uint8]]) -> str | None:
    import cv2

    flags = cv2.CALIB_CB_LARGER | cv2.CALIB_CB_NORMALIZE_IMAGE
    shapes: list[tuple[int, int]] = []
    for grey in greys:
        found, _, meta = cv2.findChessboardCornersSBWithMeta(grey, (3, 3), flags)
        if found:
            shapes.append((int(meta.shape[1]), int(meta.shape[0])))
    if not shapes:
        return None
    columns, rows = max(shapes, key=lambda shape: (shapes.count(shape), shape[0] * shape[1]))
    return (
        f"they show a chessboard of {columns} x {rows} inner corners: write target: {{kind: chessboard, "
        f"columns: {columns}, rows: {rows}, square_m: S}} with the side S of a square in m"
    )


def _markers(greys: Sequence[NDArray[np.uint8]]) -> str | None:
    import cv2

    best: tuple[int, str, int, int] = 0, "", 0, 1
    for name, border in _READINGS:
        parameters = cv2.aruco.DetectorParameters()
        parameters.markerBorderBits = border
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
        detector = cv2.aruco.ArucoDetector(dictionary, parameters)
        counts = [
            0 if (ids := detector.detectMarkers(grey)[1]) is None else len(np.unique(ids)) for grey in greys
        ]
        best = max(best, (sum(counts), name, max(counts), border))
    total, name, most, border = best
    if total < len(greys) / 2:
        return None
    family = _FAMILIES.get(name)
    if family and (border == _KALIBR_BORDER or most >= _BOARD_FROM):
        return (
            f"they show up to {most} tags of {family}: write target: {{kind: aprilgrid, columns: C, rows: R, tag_m: S, "
            f"spacing: G, family: {family}}} with the side S of a tag in m and the white between two over it"
        )
    if most < _BOARD_FROM and not family:
        return (
            f"they show markers of {name}: write target: {{kind: aruco, dictionary: {name}, id: N, size_m: S}} with "
            "the side S of the black square in m"
        )
    if most < _BOARD_FROM:
        return (
            f"they show tags of {family}: write target: {{kind: apriltag, family: {family}, id: -1, "
            "size_m: S} with the side S of the black square in m"
        )
    return (
        f"they show up to {most} markers of {name}: write target: {{kind: charuco, columns: C, rows: R, square_m: S, "
        f"marker_m: M, dictionary: {name}}} with the board's squares, or, without black squares between the markers, "
        f"{{kind: aruco_grid, columns: C, rows: R, marker_m: M, gap_m: G, dictionary: {name}}}"
    )
