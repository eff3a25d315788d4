# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: ANN001, ANN201
"""The compiled sums of the guess-free search: moments of a drawing, and the pixels it shares with a mask."""

from __future__ import annotations

import numba

from hecbench.rendering.kernels import see

_jit = numba.njit(cache=True, nogil=True)


@_jit
def coverage(scene, sight, camera_T_parents, parent_T_link, covered):
    """Fill `covered` (n, N, H, W) with 1 where the robot is drawn in a view, 0 elsewhere and where all views have it.

    `scene` and `sight` are those of a `Renderer`, `camera_T_parents` is (n, 4, 4), `parent_T_link` (N, L, 4, 4).
    """
    face, box = sight.face, sight.box
    views = len(parent_T_link)
    covered[:] = 0
    for n in range(len(camera_T_parents)):
        here = covered[n]
        for v in range(views):
            see(scene, sight, camera_T_parents[n], parent_T_link[v])
            for y in range(box[2], box[3] + 1):
                for x in range(box[0], box[1] + 1):
                    here[v, y, x] = face[y, x] >= 0
        for y in range(box[2], box[3] + 1):
            for x in range(box[0], box[1] + 1):
                by = 0
                for v in range(views):
                    by += here[v, y, x] > 0
                if by == views:
                    here[:, y, x] = 0


@_jit
def moments(face, nearness, box):
    """Of the drawn pixels: how many, mean column, mean row, mean 1/depth."""
    count, across, down, near = 0, 0.0, 0.0, 0.0
    for y in range(box[2], box[3] + 1):
        for x in range(box[0], box[1] + 1):
            if face[y, x] >= 0:
                count += 1
                across += x
                down += y
                near += nearness[y, x]
    n = max(count, 1)
    return count, across / n, down / n, near / n


@_jit
def shared_pixels(face, mask, box):
    """How many pixels are drawn, and how many of those lie in the mask (H, W) bool."""
    drawn, shared = 0, 0
    for y in range(box[2], box[3] + 1):
        for x in range(box[0], box[1] + 1):
            if face[y, x] >= 0:
                drawn += 1
                shared += mask[y, x]
    return drawn, shared
