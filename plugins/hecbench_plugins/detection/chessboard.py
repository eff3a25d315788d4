"""Inner corners of chessboards: found by OpenCV's sector-based detector (Duda and Frese 2018), then refined.

The refinement by gradients (Foerstner and Guelch 1987) halves the detector's error on sharp pictures.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hecbench.se3 import Array
from hecbench_plugins.detection.orientation import is_regular, unmirrored
from hecbench_plugins.detection.settings import CHESSBOARD

Grey = NDArray[np.uint8]


def corners(grey: Grey, columns: int, rows: int) -> Array | None:
    """Corners (columns * rows, 2) px, row by row, or None.

    A board with an odd number of columns and an even one of rows (or the reverse) looks different upside
    down; then the first square is a light one. Which end of the others comes first is decided elsewhere.
    """
    import cv2

    criteria = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 50, 1e-3)
    shrink = max(1, 2 ** int(np.log2(min(grey.shape) / CHESSBOARD.least_height_px)))
    for size, thorough in {(shrink, 0): None, (1, 0): None, (1, cv2.CALIB_CB_EXHAUSTIVE): None}:
        small = cv2.resize(grey, None, fx=1 / size, fy=1 / size, interpolation=cv2.INTER_AREA)
        flags = cv2.CALIB_CB_NORMALIZE_IMAGE | thorough
        found, points = cv2.findChessboardCornersSB(small, (columns, rows), flags=flags)
        if not found:
            continue
        points = size * points + np.float32((size - 1) / 2)
        window = _window(points.reshape(rows, columns, 2))
        points = cv2.cornerSubPix(grey, points, (window, window), (-1, -1), criteria)
        grid = unmirrored(np.asarray(points, float).reshape(rows, columns, 2))
        lightness = _first_square_lightness(grey, grid)
        if is_regular(grid) and abs(lightness) > CHESSBOARD.least_contrast and _are_crossings(grey, grid):
            return (grid[::-1, ::-1] if (columns + rows) % 2 and lightness < 0 else grid).reshape(-1, 2)
    return None


def _window(grid: Array) -> int:
    """Half the refinement window, px: half the closest corners' distance, so that it holds one."""
    sides = [np.linalg.norm(np.diff(grid, axis=axis), axis=2).min() for axis in (0, 1)]
    return int(np.clip(min(sides) / 2, *CHESSBOARD.window_px))


def _are_crossings(grey: Grey, grid: Array) -> bool:
    """Whether two dark and two light squares meet in every corner; at the outline there is one dark one at most.

    A grid of which a row lies outside the picture may otherwise be found one row too far the other way.
    """
    across, down = np.gradient(grid, axis=1), np.gradient(grid, axis=0)
    squares = np.array(
        [
            np.mean(
                [_grey_at(grey, grid + share * (x * across + y * down)) for share in CHESSBOARD.into_square],
                axis=0,
            )
            for x, y in ((1, 1), (-1, -1), (1, -1), (-1, 1))
        ]
    )
    first = np.where(np.indices(grid.shape[:2]).sum(0) % 2 == 0, 1.0, -1.0)
    sign = first * np.sign(np.median(first * (squares[:2].sum(0) - squares[2:].sum(0))))
    light, dark = np.where(sign > 0, squares[:2], squares[2:]), np.where(sign > 0, squares[2:], squares[:2])
    spread = np.maximum(squares.max(0) - squares.min(0), 1.0)
    return bool(((light.min(0) - dark.max(0)) / spread > CHESSBOARD.least_crossing).all())


def _grey_at(grey: Grey, points: Array) -> Array:
    """Grey levels at points (..., 2) px; those at the border for points outside."""
    x, y = np.rint(points).astype(int).transpose(2, 0, 1)
    return np.asarray(grey[np.clip(y, 0, grey.shape[0] - 1), np.clip(x, 0, grey.shape[1] - 1)], float)


def _first_square_lightness(grey: Grey, grid: Array) -> float:
    """How much lighter the squares of the first one's colour are than the others, in standard deviations of
    all: 2 on a chessboard with the first one light, -2 with it dark, about 0 on anything else."""
    centres = (grid[:-1, :-1] + grid[1:, :-1] + grid[:-1, 1:] + grid[1:, 1:]) / 4
    brightness = _grey_at(grey, centres)
    row, column = np.indices(brightness.shape)
    same = (row + column) % 2 == 0
    if same.all():
        return 0.0
    return float((brightness[same].mean() - brightness[~same].mean()) / max(brightness.std(), 1.0))
