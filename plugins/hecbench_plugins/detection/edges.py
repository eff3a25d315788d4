"""Corners of a dark quadrilateral on white as the crossings of its edges.

Along each edge the picture is read across it; the steepest rise, averaged over its width, says where the edge is,
whatever the blur, as long as it is symmetric. Lines are fitted to these points by total least squares. The ends of an
edge are left out: there blur rounds the corner, and other squares may touch it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hecbench.se3 import Array
from hecbench_plugins.detection.settings import EDGES


def apart(corners_px: Array, other: Array) -> bool:
    """Whether two quadrilaterals (4, 2) px are not the same square, found twice."""
    width = np.linalg.norm(other[1] - other[0])
    return bool(np.linalg.norm(corners_px.mean(0) - other.mean(0)) > width / 2)


def refined(grey: NDArray[np.uint8], corners_px: Array, cells: int) -> Array | None:
    """Corners (4, 2) px, clockwise in the picture, of a black square of `cells` cells a side; None without edges."""
    found = corners_px
    sides = np.linalg.norm(np.roll(corners_px, -1, 0) - corners_px, axis=1)
    reach = float(np.clip(EDGES.reach_cells * sides.min() / cells, *EDGES.reach_px))
    for _ in range(EDGES.rounds):
        edges = (_line(grey, found[i], found[(i + 1) % 4], reach) for i in range(4))
        lines = [line for line in edges if line is not None]
        if len(lines) < 4:
            return None
        crossings = np.array([np.cross(lines[i - 1], lines[i]) for i in range(4)])
        found = crossings[:, :2] / crossings[:, 2:]
        if (
            not np.isfinite(found).all()
            or np.linalg.norm(found - corners_px, axis=1).max() > EDGES.farthest_px
        ):
            return None
    return found


def _line(grey: NDArray[np.uint8], start: Array, end: Array, reach: float) -> Array | None:
    """The line (3,), a x + b y + c = 0, of the edge between two corners; None without a step from black to white."""
    import cv2

    along = end - start
    length = float(np.linalg.norm(along))
    direction = along / length
    outward = np.array([direction[1], -direction[0]])
    places = np.linspace(EDGES.ends, 1 - EDGES.ends, max(6, int(length)))
    offsets = np.arange(-reach, reach + EDGES.step_px / 2, EDGES.step_px)
    points = start + places[:, None, None] * along + offsets[:, None] * outward
    x, y = np.moveaxis(points, -1, 0).astype(np.float32)
    values = np.asarray(cv2.remap(grey, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), float)
    rise = np.maximum(np.diff(values, axis=1), 0.0)
    weights = rise.sum(1)
    if np.median(weights) < EDGES.least_contrast:
        return None
    middles = (offsets[:-1] + offsets[1:]) / 2
    clear = weights > EDGES.least_contrast / 2
    edge = (rise @ middles)[clear] / weights[clear]
    on_edge = start + places[clear, None] * along + edge[:, None] * outward
    share = weights[clear] / weights[clear].sum()
    centre = share @ on_edge
    spread = (on_edge - centre).T * share @ (on_edge - centre)
    normal = np.linalg.eigh(spread)[1][:, 0]
    return np.array([*normal, -normal @ centre])
