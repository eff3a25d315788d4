# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: ANN001, ANN201
"""The compiled loops over a mesh's edges: where they cross between pixel centres, and the picture mixed there.

Pixel centres at +0.5, as in `kernels`. `edges`, `sight` and `found` are `Edges`, `Sight` and `CrossingBuffers`.
"""

from __future__ import annotations

import numba
import numpy as np

_HALF = np.float32(0.5)
_ONE = np.float32(1.0)
_ZERO = np.float32(0.0)
_STEEPEST = np.float32(2.0)
"""Columns per row from which an edge does not count as crossing a row: its place there says too little."""
_BEFORE_BACKGROUND = np.float32(0.2)
_BEFORE_ROBOT = np.float32(0.02)
"""How much less near, relatively, an edge may be than the pixel it bounds: round parts fall away from the eye.

Before another part of the robot the first holds as long as the edge is nearer than that part, else the second.
"""

_jit = numba.njit(fastmath=True, cache=True, nogil=True, boundscheck=False)


@_jit
def half_plane(distance, slope):
    """What a straight edge covers of a pixel beyond its border, and the derivative by `distance`.

    The edge crosses the row of pixel centres `distance` inside the border and moves by `slope` (in [0, 1]) columns
    per row: the exact integral of max(0, distance - slope * y) over y in [-1/2, 1/2].
    """
    reach = _HALF * slope
    if distance >= reach:
        return distance, _ONE
    if distance <= -reach:
        return _ZERO, _ZERO
    inside = distance + reach
    return inside * inside / (slope + slope), inside / slope


@_jit
def find_crossings(edges, sight, found):
    """Where visible mesh edges cross between neighbouring pixel centres whose parts differ.

    Fills `pair`, `place` and `edge` of `found`. Of several edges across a pair the outermost counts. It must not lie
    behind the nearer pixel and, between two links, belong to the nearer. Returns the number found.
    """
    edge_ends, edge_faces, edge_kinds, face_part, face_link = edges
    _, screen, front, order, nearness, face, box = sight
    best, pair, place, edge = found.best, found.pair, found.place, found.edge
    height, width = nearness.shape
    size = height * width
    flat, depths, ids = best.reshape(-1), nearness.reshape(-1), face.reshape(-1)
    left, right = max(0, box[0] - 1), min(width - 1, box[1] + 1)
    top, bottom = max(0, box[2] - 1), min(height - 1, box[3] + 1)
    for axis in range(2):
        for y in range(top, bottom + 1):
            for x in range(left, right + 1):
                best[axis, y, x] = -1
    chosen = 0
    for e in range(edge_kinds[0]):
        order[chosen] = e
        chosen += front[edge_faces[e, 0]] != front[edge_faces[e, 1]]
    for e in range(edge_kinds[0], edge_kinds[1]):
        order[chosen] = e
        chosen += front[edge_faces[e, 0]] | front[edge_faces[e, 1]]
    for e in range(edge_kinds[1], edge_kinds[2]):
        order[chosen] = e
        chosen += front[edge_faces[e, 0]]
    count = 0
    for n in range(chosen):
        e = order[n]
        i, j = edge_ends[e, 0], edge_ends[e, 1]
        if screen[2, i] <= _ZERO or screen[2, j] <= _ZERO:
            continue
        for axis in range(2):
            along, across = 1 - axis, axis
            start, end = screen[along, i], screen[along, j]
            low, high = (top, bottom) if axis == 0 else (left, right)
            first = max(low, int(np.ceil(min(start, end) - _HALF)))
            last = min(high, int(np.ceil(max(start, end) - _HALF)) - 1)
            if first > last:
                continue
            inverse = _ONE / (end - start)
            for line in range(first, last + 1):
                s = (np.float32(line) + _HALF - start) * inverse
                u = screen[across, i] + s * (screen[across, j] - screen[across, i]) - _HALF
                cell = int(np.floor(u))
                if axis == 0:
                    if cell < left or cell >= right:
                        continue
                    p = line * width + cell
                    q = p + 1
                else:
                    if cell < top or cell >= bottom:
                        continue
                    p = cell * width + line
                    q = p + width
                fp, fq = ids[p], ids[q]
                if fp == fq:
                    continue
                part_p = face_part[fp] if fp >= 0 else -1
                part_q = face_part[fq] if fq >= 0 else -1
                if part_p == part_q:
                    continue
                zp, zq = depths[p], depths[q]
                near_is_p = zp >= zq
                nearest = max(zp, zq)
                least = nearest * (_ONE - _BEFORE_BACKGROUND)
                if fp >= 0 and fq >= 0:
                    least = min(max(least, min(zp, zq)), nearest * (_ONE - _BEFORE_ROBOT))
                    if face_link[fp if near_is_p else fq] != face_link[edge_faces[e, 0]]:
                        continue
                depth = screen[2, i] + s * (screen[2, j] - screen[2, i])
                if depth < least:
                    continue
                t = u - np.float32(cell)
                key = axis * size + p
                old = flat[key]
                if old >= 0:
                    if (t > place[old, 0]) == near_is_p:
                        place[old, 0], place[old, 1], edge[old] = t, s, e
                    continue
                if count >= len(pair):
                    return count
                flat[key] = count
                pair[count], place[count, 0], place[count, 1], edge[count] = key, t, s, e
                count += 1
    return count


@_jit
def describe_crossings(edges, sight, K, count, found):
    """Fill what the first `count` crossings of `found` do and how they move: `ends`, `link`, ..., `mix`.

    Where contours cross both a row and a column next to a pixel, the axis that changes it more counts alone: mostly
    both are the same line. An edge at less than 45 degrees to its pair counts only for pixels that nothing else
    changes. Returns how many crossings are left.
    """
    edge_ends, edge_faces, _, face_part, face_link = edges
    screen, face = sight.screen, sight.face
    _, taken, pair, place, edge, ends, link, point, gradient, slope, mix = found
    height, width = face.shape
    size = height * width
    ids = face.reshape(-1)
    fx, skew, cx, fy, cy = K[0], K[1], K[2], K[3], K[4]
    for n in range(count):
        axis = 0 if pair[n] < size else 1
        p = pair[n] - axis * size
        q = p + 1 if axis == 0 else p + width
        e = edge[n]
        i, j = edge_ends[e, 0], edge_ends[e, 1]
        t, s = place[n, 0], place[n, 1]
        ends[n, 0], ends[n, 1] = p, q
        ends[n, 2] = face_part[ids[p]] if ids[p] >= 0 else -1
        ends[n, 3] = face_part[ids[q]] if ids[q] >= 0 else -1
        link[n] = face_link[edge_faces[e, 0]]
        du, dv = screen[0, j] - screen[0, i], screen[1, j] - screen[1, i]
        inverse = screen[2, i] + s * (screen[2, j] - screen[2, i])
        down = (screen[1, i] + s * dv - cy) / fy
        across = (screen[0, i] + s * du - cx - skew * down) / fx
        point[n, 0], point[n, 1], point[n, 2] = across / inverse, down / inverse, _ONE / inverse
        gu2 = -(fx * across + skew * down) * inverse
        gv2 = -fy * down * inverse
        k = du / dv if axis == 0 else dv / du
        if axis == 0:
            gradient[n, 0] = fx * inverse
            gradient[n, 1] = (skew - k * fy) * inverse
            gradient[n, 2] = gu2 - k * gv2
        else:
            gradient[n, 0] = -k * fx * inverse
            gradient[n, 1] = (fy - k * skew) * inverse
            gradient[n, 2] = gv2 - k * gu2
        slope[n] = k
        mix[n, 0], mix[n, 1] = half_plane(_HALF - t, min(abs(k), _ONE))
        mix[n, 2], mix[n, 3] = half_plane(t - _HALF, min(abs(k), _ONE))
        if abs(k) <= _ONE:
            taken[axis * size + p] += mix[n, 0]
            taken[axis * size + q] += mix[n, 2]
    for n in range(count):
        axis = 0 if pair[n] < size else 1
        for end in range(2):
            here, other = taken[axis * size + ends[n, end]], taken[(1 - axis) * size + ends[n, end]]
            if abs(slope[n]) > _ONE:
                mixed = here == _ZERO and other == _ZERO and abs(slope[n]) < _STEEPEST
            else:
                mixed = other < here or (other == here and axis == 0)
            if not mixed:
                mix[n, 2 * end], mix[n, 2 * end + 1] = _ZERO, _ZERO
    for n in range(count):
        for end in range(2):
            taken[ends[n, end]] = _ZERO
            taken[size + ends[n, end]] = _ZERO
    kept = 0
    for n in range(count):
        if mix[n, 1] > _ZERO or mix[n, 3] > _ZERO:
            for k in range(4):
                ends[kept, k], mix[kept, k] = ends[n, k], mix[n, k]
            for k in range(3):
                point[kept, k], gradient[kept, k] = point[n, k], gradient[n, k]
            link[kept], slope[kept], place[kept, 0] = link[n], slope[n], place[n, 0]
            kept += 1
    return kept


@_jit
def compose(face, face_part, colours, ends, mix, count, box, painted, image):
    """Paint `image` (H, W, 4): flat `colours` (P + 1, 4), the last the background's, mixed at edges.

    Only `box` and `painted`, the rectangle that the last call painted, are touched; `painted` becomes this call's.
    """
    height, width = face.shape
    background = len(colours) - 1
    for y in range(min(box[2], painted[2]), max(box[3], painted[3]) + 1):
        for x in range(min(box[0], painted[0]), max(box[1], painted[1]) + 1):
            f = face[y, x]
            part = background
            if f >= 0:
                part = face_part[f]
            image[y, x, 0] = colours[part, 0]
            image[y, x, 1] = colours[part, 1]
            image[y, x, 2] = colours[part, 2]
            image[y, x, 3] = colours[part, 3]
    painted[0], painted[1] = max(0, box[0] - 1), min(width - 1, box[1] + 1)
    painted[2], painted[3] = max(0, box[2] - 1), min(height - 1, box[3] + 1)
    for n in range(count):
        p, q = ends[n, 0], ends[n, 1]
        for k in range(4):
            change = colours[ends[n, 3], k] - colours[ends[n, 2], k]
            image[p // width, p % width, k] += mix[n, 0] * change
            image[q // width, q % width, k] -= mix[n, 2] * change
