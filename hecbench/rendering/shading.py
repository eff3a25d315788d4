# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: ANN001, ANN201, ANN202
"""A lamp at the camera: shade by the cosine between normal and viewing ray, and how the shaded picture moves.

Normals are interpolated over the faces (Phong 1975, "Illumination for computer generated pictures"). CAD meshes hold
creases and letters that are smaller than pixels, so that the derivative at the one point that a pixel's centre meets
says nothing about the pixel. Between neighbours without an edge the picture is therefore a linear finite element
(Zienkiewicz and Taylor 2000, volume 3, section 2): a pixel shows the samples weighed by its consistent mass
(1/6, 2/3, 1/6) per axis, and moves by half the difference of its neighbours times the surface's speed.
"""

from __future__ import annotations

import numba
import numpy as np

_ONE, _ZERO, _HALF, _SIXTH = np.float32(1), np.float32(0), np.float32(0.5), np.float32(1 / 6)

_jit = numba.njit(fastmath=True, cache=True, nogil=True, boundscheck=False)


@_jit
def shade_pixels(surface, nearness, camera_T_link, K, ambient, box, shade, slide):
    """Fill `shade` (H, W) where a face is seen, and its change per m of the surface point's motion, `slide` (H, W, 3).

    The shade is ambient + (1 - ambient) cosine. `surface` is screen, faces, face, face_link and the normals' vectors
    and faces. A rotation about the camera turns normal and ray alike; only translation changes their angle.
    """
    screen, faces, face, face_link, vectors, corners = surface
    share = _ONE - ambient
    for y in range(box[2], box[3] + 1):
        for x in range(box[0], box[1] + 1):
            f = face[y, x]
            if f < 0:
                continue
            a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
            u, v = np.float32(x) + _HALF, np.float32(y) + _HALF
            ax, bx, cx = screen[0, a], screen[0, b], screen[0, c]
            ay, by, cy = screen[1, a], screen[1, b], screen[1, c]
            scale = _ONE / ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))
            w0 = ((u - cx) * (by - cy) + (v - cy) * (cx - bx)) * scale
            w1 = ((u - cx) * (cy - ay) + (v - cy) * (ax - cx)) * scale
            w0, w1, w2 = w0 * screen[2, a], w1 * screen[2, b], (_ONE - w0 - w1) * screen[2, c]
            i, j, k = corners[f, 0], corners[f, 1], corners[f, 2]
            p = w0 * vectors[0, i] + w1 * vectors[0, j] + w2 * vectors[0, k]
            q = w0 * vectors[1, i] + w1 * vectors[1, j] + w2 * vectors[1, k]
            r = w0 * vectors[2, i] + w1 * vectors[2, j] + w2 * vectors[2, k]
            scale = _ONE / np.sqrt(p * p + q * q + r * r)
            T = camera_T_link[face_link[f]]
            nx = (T[0, 0] * p + T[0, 1] * q + T[0, 2] * r) * scale
            ny = (T[1, 0] * p + T[1, 1] * q + T[1, 2] * r) * scale
            nz = (T[2, 0] * p + T[2, 1] * q + T[2, 2] * r) * scale
            across, down = _ray(np.float32(x), np.float32(y), K)
            reach = np.sqrt(across * across + down * down + _ONE)
            cosine = -(nx * across + ny * down + nz) / reach
            shade[y, x] = ambient
            slide[y, x] = _ZERO
            if cosine > _ZERO:
                shade[y, x] += share * cosine
                inverse = share * nearness[y, x] / reach
                along = cosine / reach
                slide[y, x, 0] = -inverse * (nx + along * across)
                slide[y, x, 1] = -inverse * (ny + along * down)
                slide[y, x, 2] = -inverse * (nz + along)


@_jit
def compose(face, face_part, colours, shade, crossed, ends, mix, count, box, painted, image):
    """As `kernels.compose`, each pixel's colour (not its coverage) times its shade.

    `crossed` (2, H, W) is 0 or more where an edge crosses between a pixel and the one right of it or below it.
    """
    height, width = face.shape
    background = len(colours) - 1
    for y in range(min(box[2], painted[2]), max(box[3], painted[3]) + 1):
        for x in range(min(box[0], painted[0]), max(box[1], painted[1]) + 1):
            f = face[y, x]
            part, light = background, _ONE
            if f >= 0:
                part, light = face_part[f], shade[y, x]
            for k in range(3):
                image[y, x, k] = light * colours[part, k]
            image[y, x, 3] = colours[part, 3]
    painted[0], painted[1] = max(0, box[0] - 1), min(width - 1, box[1] + 1)
    painted[2], painted[3] = max(0, box[2] - 1), min(height - 1, box[3] + 1)
    for y in range(box[2], box[3] + 1):
        for x in range(box[0], box[1] + 1):
            for axis in range(2):
                yq, xq = y + axis, x + 1 - axis
                if not _joined(y, x, axis, face, face_part, crossed, box):
                    continue
                change = _SIXTH * (shade[yq, xq] - shade[y, x])
                for k in range(3):
                    moved = change * colours[face_part[face[y, x]], k]
                    image[y, x, k] += moved
                    image[yq, xq, k] -= moved
    for n in range(count):
        p, q = ends[n, 0], ends[n, 1]
        light_p, light_q = _light(shade, ends[n, 2], p), _light(shade, ends[n, 3], q)
        for k in range(4):
            if k == 3:
                light_p, light_q = _ONE, _ONE
            change = light_q * colours[ends[n, 3], k] - light_p * colours[ends[n, 2], k]
            image[p // width, p % width, k] += mix[n, 0] * change
            image[q // width, q % width, k] -= mix[n, 2] * change


@_jit
def edge_rates(colours, shade, ends, mix, columns, count, out):
    """Add to `out` (H, W, 3, 6) how the picture moves with its crossings, whose dt by the pose is `columns` (C, 6)."""
    width = out.shape[1]
    for n in range(count):
        p, q = ends[n, 0], ends[n, 1]
        light_p, light_q = _light(shade, ends[n, 2], p), _light(shade, ends[n, 3], q)
        for k in range(3):
            change = light_p * colours[ends[n, 2], k] - light_q * colours[ends[n, 3], k]
            for m in range(6):
                moved = change * columns[n, m]
                out[p // width, p % width, k, m] += mix[n, 1] * moved
                out[q // width, q % width, k, m] += mix[n, 3] * moved


@_jit
def surface_rates(face, face_part, nearness, K, box, crossed, colours, shade, slide, out):
    """Add to `out` (H, W, 3, 6) how the shaded surfaces move between their edges, each pair at the nearer's speed."""
    for y in range(box[2], box[3] + 1):
        for x in range(box[0], box[1] + 1):
            f = face[y, x]
            if f < 0:
                continue
            part = face_part[f]
            for k in range(3):
                for m in range(3):
                    out[y, x, k, 3 + m] += colours[part, k] * slide[y, x, m]
            for axis in range(2):
                yq, xq = y + axis, x + 1 - axis
                if not _joined(y, x, axis, face, face_part, crossed, box):
                    continue
                inverse = max(nearness[y, x], nearness[yq, xq])
                a, b = _ray(_HALF * np.float32(x + xq), _HALF * np.float32(y + yq), K)
                gx, gy, gz = K[0] * inverse, K[1] * inverse, -(K[0] * a + K[1] * b) * inverse
                if axis == 1:
                    gx, gy, gz = _ZERO, K[3] * inverse, -K[3] * b * inverse
                z = _ONE / inverse
                speed = (z * (b * gz - gy), z * (gx - a * gz), z * (a * gy - b * gx), gx, gy, gz)
                change = _HALF * (shade[y, x] - shade[yq, xq])
                for k in range(3):
                    for m in range(6):
                        moved = colours[part, k] * change * speed[m]
                        out[y, x, k, m] += moved
                        out[yq, xq, k, m] += moved


@_jit
def _joined(y, x, axis, face, face_part, crossed, box):
    """Whether a pixel and the one right of it (axis 0) or below it show one part without an edge between them."""
    yq, xq = y + axis, x + 1 - axis
    if yq > box[3] or xq > box[1] or crossed[axis, y, x] >= 0:
        return False
    f, g = face[y, x], face[yq, xq]
    return f >= 0 and g >= 0 and face_part[f] == face_part[g]


@_jit
def _light(shade, part, pixel):
    """The shade of a flat pixel by its part, 1 on the background (-1)."""
    return _ONE if part < 0 else shade.reshape(-1)[pixel]


@_jit
def _ray(x, y, K):
    down = (y + _HALF - K[4]) / K[3]
    return (x + _HALF - K[2] - K[1] * down) / K[0], down
