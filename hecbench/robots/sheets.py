"""Which faces are seen from behind: sheets, cups, and shells whose faces are turned inwards.

A link is drawn from 26 sides with a depth buffer. Where the nearest face shows its back, it must be drawn from both
sides; closed bodies never show one, so their backs cost nothing.
"""

from __future__ import annotations

from itertools import product

import numba
import numpy as np
from numpy.typing import NDArray

from hecbench.se3 import Array

_jit = numba.njit(cache=True, nogil=True)

_PIXELS = 256
"""Along the longest side of the link."""
_SLACK = 1e-3
"""Of the longest side: a front this close behind a back hides it, as in a plate of both."""
_SEAM = 1e-3
"""Of a front's barycentric coordinates beyond its edge: nothing is seen between two that meet."""
_RINGS = 1
"""Neighbours of a face seen from behind that count too: some are smaller than a pixel."""


def seen_from_behind(vertices: Array, faces: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Which faces (F,) of one link show their back from somewhere outside it.

    Args:
        vertices: (V, 3) m, those at one place merged.
        faces: (F, 3), counter-clockwise from outside.
    """
    seen = np.zeros(len(faces), np.bool_)
    low, high = vertices.min(0), vertices.max(0)
    size = float((high - low).max())
    if size == 0.0:
        return seen
    places = (vertices - (low + high) / 2) * (_PIXELS / size)
    for sides in product((-1.0, 0.0, 1.0), repeat=3):
        if not any(sides):
            continue
        ahead = np.array(sides) / np.linalg.norm(sides)
        right = np.cross(np.eye(3)[np.abs(ahead).argmin()], ahead)
        right /= np.linalg.norm(right)
        drawn = places @ np.stack([right, np.cross(ahead, right), ahead], 1)
        corner = drawn[:, :2].min(0) - 1
        _draw(
            drawn - [*corner, 0.0],
            faces,
            np.ptp(drawn[:, :2], axis=0).astype(np.int64) + 3,
            _SLACK * _PIXELS,
            seen,
        )
    touched = np.zeros(len(vertices), np.bool_)
    for _ in range(_RINGS if seen.any() else 0):
        touched[faces[seen]] = True
        seen = touched[faces].any(1)
    return seen


@_jit  # type: ignore[untyped-decorator]
def _draw(
    places: Array, faces: NDArray[np.integer], size: NDArray[np.int64], slack: float, seen: NDArray[np.bool_]
) -> None:
    """Draw faces along +z at px coordinates; mark in `seen` those whose back is nearest in a pixel."""
    nearest = np.full((size[1], size[0]), np.inf)
    owner = np.full((size[1], size[0]), -1)
    for face in range(len(faces)):
        a, b, c = places[faces[face, 0]], places[faces[face, 1]], places[faces[face, 2]]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0.0:
            continue
        left, right = int(np.ceil(min(a[0], b[0], c[0]))), int(np.floor(max(a[0], b[0], c[0])))
        top, bottom = int(np.ceil(min(a[1], b[1], c[1]))), int(np.floor(max(a[1], b[1], c[1])))
        for y in range(top, bottom + 1):
            for x in range(left, right + 1):
                v = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area
                w = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area
                edge = 0.0 if area > 0.0 else -_SEAM
                if v < edge or w < edge or v + w > 1.0 - edge:
                    continue
                depth = a[2] + v * (b[2] - a[2]) + w * (c[2] - a[2]) + (slack if area > 0.0 else 0.0)
                if depth < nearest[y, x]:
                    nearest[y, x] = depth
                    owner[y, x] = face if area > 0.0 else -1
    for face in owner.ravel():
        if face >= 0:
            seen[face] = True
