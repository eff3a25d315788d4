# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: ANN001, ANN201, ANN202
"""The compiled loops that find what each pixel centre sees.

Pixel centres at +0.5; depth is kept as 1/z, larger is nearer. `scene` and `sight` are `Scene` and `Sight`.

Everything works on arrays that the caller owns; nothing is allocated here. The caller checks that all input is
finite: fast arithmetic assumes it.
"""

from __future__ import annotations

import numba
import numpy as np

NEAR_M = np.float32(0.05)
_HALF = np.float32(0.5)
_ONE = np.float32(1.0)
_ZERO = np.float32(0.0)
_SMALL_BOX = 4

_jit = numba.njit(fastmath=True, cache=True, nogil=True, boundscheck=False)


@_jit
def project(scene, sight):
    """Fill the `screen` of a `Sight` with u, v and 1/z of the `Scene`, and `front` with which faces face us."""
    vertices, vertex_start, planes, face_start, _, K = scene
    camera_T_link, screen, front = sight.camera_T_link, sight.screen, sight.front
    fx, skew, cx, fy, cy = K[0], K[1], K[2], K[3], K[4]
    for link in range(len(vertex_start) - 1):
        T = camera_T_link[link]
        a, b, c, d = T[0, 0], T[0, 1], T[0, 2], T[0, 3]
        e, f, g, h = T[1, 0], T[1, 1], T[1, 2], T[1, 3]
        i, j, k, m = T[2, 0], T[2, 1], T[2, 2], T[2, 3]
        for n in range(vertex_start[link], vertex_start[link + 1]):
            x, y, z = vertices[0, n], vertices[1, n], vertices[2, n]
            depth = i * x + j * y + k * z + m
            inverse = _ONE / depth if depth > NEAR_M else _ZERO
            across = (a * x + b * y + c * z + d) * inverse
            down = (e * x + f * y + g * z + h) * inverse
            screen[0, n] = fx * across + skew * down + cx
            screen[1, n] = fy * down + cy
            screen[2, n] = inverse
        px = -(a * d + e * h + i * m)
        py = -(b * d + f * h + j * m)
        pz = -(c * d + g * h + k * m)
        for n in range(face_start[link], face_start[link + 1]):
            front[n] = planes[0, n] * px + planes[1, n] * py + planes[2, n] * pz + planes[3, n] > _ZERO


@_jit
def rasterise(scene, sight):
    """Draw the front faces of a `Scene` into `nearness` and `face` of a `Sight`.

    `box` holds the touched rectangle of the last call, which alone is cleared, and gets the new one. Returns how many
    front faces were not drawn because they reach behind the near plane.
    """
    faces = scene.faces
    _, screen, front, order, nearness, face, box = sight
    height, width = nearness.shape
    for y in range(box[2], box[3] + 1):
        for x in range(box[0], box[1] + 1):
            nearness[y, x] = _ZERO
            face[y, x] = -1
    left, right, top, bottom = width, -1, height, -1
    facing = 0
    for f in range(len(faces)):
        order[facing] = f
        facing += front[f]
    visible = 0
    dropped = 0
    for n in range(facing):  # without branches: most faces of a fine mesh hold no pixel centre
        f = order[n]
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        ax, bx, cx = screen[0, a], screen[0, b], screen[0, c]
        ay, by, cy = screen[1, a], screen[1, b], screen[1, c]
        before = min(screen[2, a], screen[2, b], screen[2, c]) > _ZERO
        across = np.ceil(min(ax, bx, cx) - _HALF) <= np.floor(max(ax, bx, cx) - _HALF)
        down = np.ceil(min(ay, by, cy) - _HALF) <= np.floor(max(ay, by, cy) - _HALF)
        order[visible] = f
        visible += before & across & down
        dropped += not before
    for n in range(visible):
        f = order[n]
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        ax, bx, cx = screen[0, a], screen[0, b], screen[0, c]
        ay, by, cy = screen[1, a], screen[1, b], screen[1, c]
        y0 = max(0, int(np.ceil(min(ay, by, cy) - _HALF)))
        y1 = min(height - 1, int(np.floor(max(ay, by, cy) - _HALF)))
        x0 = max(0, int(np.ceil(min(ax, bx, cx) - _HALF)))
        x1 = min(width - 1, int(np.floor(max(ax, bx, cx) - _HALF)))
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area >= _ZERO or x0 > x1 or y0 > y1:
            continue
        az, bz, cz = screen[2, a], screen[2, b], screen[2, c]
        scale = _ONE / area
        w0x, w0y = (by - cy) * scale, (cx - bx) * scale
        w1x, w1y = (cy - ay) * scale, (ax - cx) * scale
        zx = w0x * (az - cz) + w1x * (bz - cz)
        left, right = min(left, x0), max(right, x1)
        top, bottom = min(top, y0), max(bottom, y1)
        for y in range(y0, y1 + 1):
            py = np.float32(y) + _HALF
            px = np.float32(x0) + _HALF
            w0 = (px - cx) * w0x + (py - cy) * w0y
            w1 = (px - cx) * w1x + (py - cy) * w1y
            first, last = x0, x1
            if x1 - x0 > _SMALL_BOX:
                first, last = _span(w0, w0x, w1, w1x, x0, x1)
                skip = np.float32(first - x0)
                w0 += skip * w0x
                w1 += skip * w1x
            z = cz + w0 * (az - cz) + w1 * (bz - cz)
            for x in range(first, last + 1):
                if min(w0, w1, _ONE - w0 - w1) >= _ZERO and z > nearness[y, x]:
                    nearness[y, x] = z
                    face[y, x] = f
                w0 += w0x
                w1 += w1x
                z += zx
    box[0], box[1], box[2], box[3] = left, right, top, bottom
    return dropped


@_jit
def see(scene, sight, camera_T_parent, parent_T_link):
    """What `Renderer.rasterise` does at poses of the links (L, 4, 4) behind a pose (4, 4), for other compiled loops.

    `scene` and `sight` are those of a `Renderer`.
    """
    for link in range(len(parent_T_link)):
        for i in range(3):
            for j in range(4):
                total = 0.0
                for k in range(4):
                    total += camera_T_parent[i, k] * parent_T_link[link, k, j]
                sight.camera_T_link[link, i, j] = total
    project(scene, sight)
    return rasterise(scene, sight)


@_jit
def _span(w0, w0x, w1, w1x, x0, x1):
    """Columns between which all three barycentric weights can be positive, one pixel generous."""
    low, high = _ZERO, np.float32(x1 - x0)
    for value, slope in ((w0, w0x), (w1, w1x), (_ONE - w0 - w1, -w0x - w1x)):
        if slope > _ZERO:
            low = max(low, -value / slope)
        elif slope < _ZERO:
            high = min(high, -value / slope)
    return x0 + max(0, int(low) - 1), min(x1, x0 + int(max(high, -_ONE)) + 1)
