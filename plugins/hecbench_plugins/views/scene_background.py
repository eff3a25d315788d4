# mypy: disable-error-code="no-untyped-def,assignment"
# ruff: noqa: ANN001, ANN202
"""What a fixed camera sees when nothing moves, from several pictures, and what in each picture is not that."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError
from hecbench.system import threads
from hecbench_plugins.views.spool import Spool

Pictures = NDArray[np.uint8]
Floats = NDArray[np.float32]

FEWEST_VIEWS = 3
SAME_COLOUR = 20
"""Largest channel difference, of 255, of two sights of the same thing, exclusive."""
_STRIP_ROWS = 32
"""Rows of all views that are held in memory at once."""
_BLUR_PX = 1.0
_NOISE, _WIDTH = 6.0, 14.0
"""Channel difference that says nothing, and how much more makes a pixel foreground (1 - 1/e)."""
_CERTAIN = _NOISE + 3 * _WIDTH


@numba.njit(cache=True, nogil=True)
def _mode(images, same, background, agree):
    """Fill `background` (H, W, 3) and `agree` (H, W) from `images` (N, H, W, 3).

    Row by row, so that a row of all views stays in the cache; the loops over columns hold 8-bit numbers alone,
    which the compiler handles many at once: that makes all N (N - 1) / 2 comparisons affordable.
    """
    count, height, width, _ = images.shape
    row = np.empty((3, count, width), np.uint8)
    votes = np.empty((count, width), np.uint8)
    limit = np.uint8(same)
    for y in range(height):
        for v in range(count):
            for x in range(width):
                row[0, v, x] = images[v, y, x, 0]
                row[1, v, x] = images[v, y, x, 1]
                row[2, v, x] = images[v, y, x, 2]
        votes[:] = 1
        for i in range(count):
            r, g, b, mine = row[0, i], row[1, i], row[2, i], votes[i]
            for j in range(i + 1, count):
                r2, g2, b2, theirs = row[0, j], row[1, j], row[2, j], votes[j]
                for x in range(width):
                    dr = np.uint8(max(r[x], r2[x]) - min(r[x], r2[x]))
                    dg = np.uint8(max(g[x], g2[x]) - min(g[x], g2[x]))
                    db = np.uint8(max(b[x], b2[x]) - min(b[x], b2[x]))
                    shared = np.uint8(max(max(dr, dg), db) < limit)
                    mine[x] = np.uint8(mine[x] + shared)
                    theirs[x] = np.uint8(theirs[x] + shared)
        for x in range(width):
            chosen = 0
            for v in range(1, count):
                if votes[v, x] > votes[chosen, x]:
                    chosen = v
            red, green, blue = 0, 0, 0
            r, g, b = np.int64(row[0, chosen, x]), np.int64(row[1, chosen, x]), np.int64(row[2, chosen, x])
            for v in range(count):
                r2, g2, b2 = np.int64(row[0, v, x]), np.int64(row[1, v, x]), np.int64(row[2, v, x])
                if abs(r2 - r) < same and abs(g2 - g) < same and abs(b2 - b) < same:
                    red, green, blue = red + r2, green + g2, blue + b2
            n = votes[chosen, x]
            background[y, x, 0] = red / n
            background[y, x, 1] = green / n
            background[y, x, 2] = blue / n
            agree[y, x] = n / count


@numba.njit(cache=True, nogil=True)
def _unlike(image, background, out):
    """Fill `out` (H, W) with the foregroundness of one blurred picture (H, W, 3) uint8 before a blurred background."""
    height, width = out.shape
    for y in range(height):
        for x in range(width):
            d = abs(np.float32(image[y, x, 0]) - background[y, x, 0])
            d = max(d, abs(np.float32(image[y, x, 1]) - background[y, x, 1]))
            d = max(d, abs(np.float32(image[y, x, 2]) - background[y, x, 2]))
            if d <= _NOISE:
                out[y, x] = 0.0
            elif d >= _CERTAIN:
                out[y, x] = 1.0
            else:
                out[y, x] = 1 - np.exp(-(((d - _NOISE) / _WIDTH) ** 2))


def background(images: Pictures | Spool) -> tuple[Floats, Floats]:
    """The scene without what moves: B (H, W, 3) in [0, 255], and `agree` (H, W), the share of the views that show it.

    Per pixel the mode over the views: the colour that the most views share (largest channel difference below
    `SAME_COLOUR`), averaged over those. Where something covers a pixel in most of the views, B shows that.

    Args:
        images: (N, H, W, 3) of one fixed camera, N from `FEWEST_VIEWS` to 255.

    Raises:
        InputError: too few or too many views, or no 8-bit RGB.
    """
    dtype = np.dtype(np.uint8) if isinstance(images, Spool) else images.dtype
    if dtype != np.uint8 or len(images.shape) != 4 or images.shape[-1] != 3:
        raise InputError(f"expected 8-bit RGB pictures (N, H, W, 3), got {dtype} {images.shape}")
    if not FEWEST_VIEWS <= len(images) <= 255:
        raise InputError(f"{len(images)} views: a background takes {FEWEST_VIEWS} to 255 of them")
    height, width = images.shape[1:3]
    scene, agree = np.empty((height, width, 3), np.float32), np.empty((height, width), np.float32)

    def strip(first: int) -> None:
        last = min(first + _STRIP_ROWS, height)
        _mode(_rows(images, first, last), SAME_COLOUR, scene[first:last], agree[first:last])

    threads.each(strip, range(0, height, _STRIP_ROWS))
    return scene, agree


def _rows(images: Pictures | Spool, first: int, last: int) -> Pictures:
    """The rows `first` to `last`, exclusive, of all pictures."""
    if isinstance(images, Spool):
        return images.rows(first, last)
    return np.ascontiguousarray(images[:, first:last])


def foreground(images: Pictures | Spool, scene: Floats) -> Floats:
    """How unlike the background each pixel is: D (N, H, W) in [0, 1], 0 = it may be the background.

    D = 1 - exp(-(max(d - 6, 0) / 14)^2) of the largest channel difference d, both blurred with a sigma of 1 px so
    that noise does not count (taken as 1 from three widths on: 0.99988).
    """
    import cv2

    blurred = cv2.GaussianBlur(scene, (0, 0), _BLUR_PX)
    unlike = np.empty(images.shape[:3], np.float32)
    for image, out in zip(images, unlike, strict=True):
        _unlike(cv2.GaussianBlur(image, (0, 0), _BLUR_PX), blurred, out)
    return unlike
