"""Centres of symmetric circle grids by OpenCV's blob detector; a larger dot in a corner marks the first.

The centre of a circle's image is not the image of its centre: at usual sizes the difference stays below
0.1 px, and is not corrected.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench.se3 import Array
from hecbench_plugins.detection.orientation import is_regular, turned_grids, unmirrored
from hecbench_plugins.detection.settings import CIRCLES

Grey = NDArray[np.uint8]


def centres(grey: Grey, columns: int, rows: int) -> tuple[Array, bool] | None:
    """Centres (columns * rows, 2) px, row by row, and whether a larger dot said which is first; or None."""
    import cv2

    detector = _blob_detector(grey.size / (columns * rows))
    for picture in (grey, 255 - grey):
        for flags in (cv2.CALIB_CB_SYMMETRIC_GRID, cv2.CALIB_CB_SYMMETRIC_GRID | cv2.CALIB_CB_CLUSTERING):
            found, points = cv2.findCirclesGrid(picture, (columns, rows), flags=flags, blobDetector=detector)
            if found:
                grid = unmirrored(np.asarray(points, float).reshape(rows, columns, 2))
                if is_regular(grid):
                    return _first_at_larger_dot(grid, detector.detect(picture))
    return None


def _blob_detector(cell_px: float) -> Any:
    """Finds dots that fill up to half a cell of so many pixels.

    Without the limit the board's own outline is a blob too, and pulls dots towards its centre.
    """
    cv2: Any = import_module("cv2")
    parameters = cv2.SimpleBlobDetector_Params()
    parameters.minArea, parameters.maxArea = CIRCLES.least_area_px, cell_px / 2
    parameters.minThreshold, parameters.maxThreshold, parameters.thresholdStep = 20, 220, 10
    parameters.minDistBetweenBlobs = 5
    parameters.filterByInertia = False
    parameters.filterByConvexity = True
    parameters.minConvexity = 0.9
    return cv2.SimpleBlobDetector_create(parameters)


def _first_at_larger_dot(grid: Array, blobs: Any) -> tuple[Array, bool]:
    positions = np.array([blob.pt for blob in blobs])
    sizes = np.array([blob.size for blob in blobs])

    def size_at(point: Array) -> float:
        return float(sizes[((positions - point) ** 2).sum(1).argmin()])

    turned = turned_grids(grid)
    ratios = [2 * size_at(g[0, 0]) / (size_at(g[0, 1]) + size_at(g[1, 0])) for g in turned]
    largest = int(np.argmax(ratios))
    marked = ratios[largest] > CIRCLES.larger
    return turned[largest if marked else 0].reshape(-1, 2), marked
