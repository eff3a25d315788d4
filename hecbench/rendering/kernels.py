# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: ANN001, ANN201, ANN202
"""The compiled loops of the rasteriser. Pixel centres at +0.5; depth is kept as 1/z, larger is nearer.

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
_STEEPEST = np.float32(2.0)
"""Columns per row from which an edge does not count as crossing a row: its place there says too little."""
_BEFORE_BACKGROUND = np.float32(0.2)
_BEFORE_ROBOT = np.float32(0.02)
"""How much less near, relatively, an edge may be than the pixel it bounds: round parts fall away from the eye.

Before another part of the robot the first holds as long as the edge is nearer than that part, else the second.
"""

_jit = numba.njit(fastmath=True, cache=True, nogil=True, boundscheck=False)


@_jit
def project(vertices, vertex_start, planes, face_start, camera_T_link, K, screen, front):
    """Fill `screen` (3, V) with u, v and 1/z (0 when nearer than the near plane), `front` (F,) with what faces us.

    `camera_T_link` is (L, 3, 4) float32; `K` is fx, skew, cx, fy, cy float32.
    """
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
def rasterise(screen, faces, front, order, nearness, face, box):
    """Draw the front faces into `nearness` (H, W) 1/m and `face` (H, W), -1 where nothing is.

    `box` holds the touched rectangle x0, x1, y0, y1 (inclusive) of the last call, which alone is cleared, and gets
    the new one; `order` (F,) is scratch. Returns how many front faces were not drawn because they reach behind the
    near plane.
    """
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
    vertices, vertex_start, planes, face_start, faces, K = scene
    camera_T_link, screen, front, order, nearness, face, box = sight
    for link in range(len(parent_T_link)):
        for i in range(3):
            for j in range(4):
                total = 0.0
                for k in range(4):
                    total += camera_T_parent[i, k] * parent_T_link[link, k, j]
                camera_T_link[link, i, j] = total
    project(vertices, vertex_start, planes, face_start, camera_T_link, K, screen, front)
    return rasterise(screen, faces, front, order, nearness, face, box)


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
def find_crossings(
    screen,
    edge_ends,
    edge_faces,
    edge_kinds,
    front,
    order,
    face,
    face_part,
    face_link,
    nearness,
    box,
    best,
    pair,
    place,
    edge,
):
    """Where visible mesh edges cross between neighbouring pixel centres whose parts differ.

    `best` (2, H, W) is scratch. Fills `pair` (C,) = flat index into `best` (axis, row, column), `place` (C, 2) =
    crossing t in [0, 1] between the centres and the parameter s along the edge on the screen, and `edge` (C,).
    Of several edges across a pair the outermost counts. It must not lie behind the nearer pixel and, between two
    links, belong to the nearer. Returns the number found.
    """
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
def describe_crossings(
    screen,
    edge_ends,
    edge_faces,
    face,
    face_part,
    face_link,
    K,
    pair,
    place,
    edge,
    count,
    taken,
    ends,
    link,
    point,
    gradient,
    slope,
    mix,
):
    """Fill what a crossing does and how it moves.

    `ends` (C, 4): the two pixels (flat) and their parts, -1 = background; `link` (C,) of the edge; `point` (C, 3) m
    on the edge in the camera frame; `gradient` (C, 3) px/m = dt/dpoint; `slope` (C,) columns per row (or rows per
    column); `mix` (C, 4): what each pixel takes of the other's colour and how that changes with t.
    Where contours cross both a row and a column next to a pixel, the axis that changes it more counts alone: mostly
    both are the same line. An edge at less than 45 degrees to its pair counts only for pixels that nothing else
    changes. `taken` (2 H W,) is scratch, zero before and after. Returns how many crossings are left.
    """
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
