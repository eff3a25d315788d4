# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: ANN001, ANN201
"""The compiled loops over the contour: colours on both sides of it, and where it really lies.

`points`, `colours` and `scene` are `ContourPoints`, `KnownColours` and `KnownScene`.
"""

from __future__ import annotations

import numba
import numpy as np

from hecbench_plugins.maskless.settings import COLOURS

BINS = COLOURS.bins

_jit = numba.njit(fastmath=True, cache=True, nogil=True)


@_jit
def colour_bin(image, y, x):
    """The place in a flat histogram of a pixel's colour."""
    return ((image[y, x, 0] >> 4) * BINS + (image[y, x, 1] >> 4)) * BINS + (image[y, x, 2] >> 4)


@_jit
def mark_covered(face, box, covered):
    """Add one to `covered` (H, W) wherever the robot was drawn; `box` holds it."""
    for y in range(box[2], box[3] + 1):
        for x in range(box[0], box[1] + 1):
            if face[y, x] >= 0:
                covered[y, x] += 1


@_jit
def count_inside(face, face_part, box, image, scene, inside):
    """Colours of the parts: adds to `inside` (P, BINS^3) over pixels whose neighbours are all robot.

    Where few enough views cover a pixel, its background is known: what looks like that is not the robot.
    """
    valid, background, _, covered, views = scene
    height, width = face.shape
    known = len(background) > 0
    for y in range(max(1, box[2]), min(height - 2, box[3]) + 1):
        for x in range(max(1, box[0]), min(width - 2, box[1]) + 1):
            f = face[y, x]
            if f < 0 or not valid[y, x]:
                continue
            if face[y - 1, x] < 0 or face[y + 1, x] < 0 or face[y, x - 1] < 0 or face[y, x + 1] < 0:
                continue
            if known and covered[y, x] < COLOURS.covered_often * views:
                off = np.int64(0)
                for c in range(3):
                    off = max(off, abs(np.int64(image[y, x, c]) - np.int64(background[y, x, c])))
                if off < COLOURS.unlike_background:
                    continue
            inside[face_part[f], colour_bin(image, y, x)] += 1.0


@_jit
def count_around(points, count, face, image, valid, reach, around):
    """Colours around the parts: adds to `around` (P, BINS^3) what lies `reach` px or less outside their contours."""
    height, width = face.shape
    contour, parts = points.place, points.parts
    for n in range(count):
        if parts[n, 1] >= 0:
            continue
        for step in range(1, reach + 1):
            distance = step + np.float32(0.5)
            x = int(np.floor(contour[n, 0] + distance * contour[n, 2] + np.float32(0.5)))
            y = int(np.floor(contour[n, 1] + distance * contour[n, 3] + np.float32(0.5)))
            if x < 0 or y < 0 or x >= width or y >= height or not valid[y, x] or face[y, x] >= 0:
                continue
            around[parts[n, 0], colour_bin(image, y, x)] += 1.0


@_jit
def likelihoods(counts, share, group, floor, out, scratch):
    """Log densities `out` (P, BINS^3) of smoothed histograms `counts`, each mixed with that of its group.

    Args:
        counts: (P, BINS^3).
        share: how much of the group's histogram is mixed in.
        group: (P,) of each histogram.
        floor: counts below which the group's weight does not fall.
        out: gets the logarithms.
        scratch: (G + 2, BINS^3).
    """
    parts, size = counts.shape
    groups = len(scratch) - 2
    sums = np.zeros(groups)
    scratch[:] = 0.0
    for p in range(parts):
        for b in range(size):
            if counts[p, b] > 0:
                scratch[group[p], b] += counts[p, b]
                sums[group[p]] += counts[p, b]
    first, second = scratch[groups], scratch[groups + 1]
    uniform = COLOURS.uniform_share / size
    for p in range(parts):
        own = 0.0
        for b in range(size):
            own += counts[p, b]
        weight = share * max(own, floor) / max(sums[group[p]], 1.0)
        for b in range(size):
            first[b] = counts[p, b] + weight * scratch[group[p], b]
        total = 0.0
        stride = 1
        for axis in range(3):
            source, target = (first, second) if axis % 2 == 0 else (second, first)
            for b in range(size):
                at = (b // stride) % BINS
                before = source[b - stride] if at > 0 else source[b]
                after = source[b + stride] if at < BINS - 1 else source[b]
                target[b] = 0.5 * source[b] + 0.25 * (before + after)
            stride *= BINS
        for b in range(size):
            total += second[b]
        scale = (1 - COLOURS.uniform_share) / max(total, 1e-9)
        for b in range(size):
            out[p, b] = np.log(scale * second[b] + uniform)


@_jit
def contour_points(crossings, found, nearness, centre, radius, points):
    """The first `found` of a renderer's `CrossingBuffers` as contour points; returns how many there are.

    Fills `place`, `normal_rate`, `parts` and `kept`. Only edges at 45 degrees or more to their pair count, each once.
    Points within `radius` of `centre` (3,), both m in the camera frame, as the camera sees it, are left out; 0 leaves
    none out.
    """
    _, _, _, place, _, ends, _, point, gradient, slope, _ = crossings
    contour, normal_rate, parts, kept, _, _ = points
    width = nearness.shape[1]
    flat = nearness.reshape(-1)
    far = np.sqrt(centre[0] ** 2 + centre[1] ** 2 + centre[2] ** 2)
    least = 2.0
    if radius > 0 and far > 0:
        least = np.cos(np.arcsin(min(0.99, radius / far)))
    count = 0
    for n in range(min(found, len(contour))):
        k, t = slope[n], place[n, 0]
        if abs(k) > 1:
            continue
        X, Y, Z = point[n, 0], point[n, 1], point[n, 2]
        if least < 1:
            along = (X * centre[0] + Y * centre[1] + Z * centre[2]) / (far * np.sqrt(X * X + Y * Y + Z * Z))
            if along > least:
                continue
        p, q = ends[n, 0], ends[n, 1]
        horizontal = q - p == 1
        length = 1 / np.sqrt(1 + k * k)
        inside_p = flat[p] >= flat[q]
        sign = length if inside_p else -length
        x, y = np.float32(p % width), np.float32(p // width)
        if horizontal:
            contour[count, 0], contour[count, 1] = x + t, y
            contour[count, 2], contour[count, 3] = sign, -k * sign
        else:
            contour[count, 0], contour[count, 1] = x, y + t
            contour[count, 2], contour[count, 3] = -k * sign, sign
        for c in range(3):
            normal_rate[count, c] = sign * gradient[n, c]
        parts[count, 0] = ends[n, 2] if inside_p else ends[n, 3]
        parts[count, 1] = ends[n, 3] if inside_p else ends[n, 2]
        kept[count] = n
        count += 1
    return count


@_jit
def line_posteriors(points, count, face, face_part, image, smooth, colours, scene, half, step):
    """Posterior mean and variance, px along the outward normal, of where each contour point really is.

    2 * `half` samples, `step` px apart, are compared: is this pixel the part, or what surrounds it? Every place of
    the contour between them explains those inside as part and those outside as surroundings, and earns by how strong
    the image's edge is there. Variance -1: no say, the point is too near the border.
    """
    contour, _, parts, _, mean, variance = points
    log_inside, log_around, mean_around = colours
    valid, background, agreement, covered, views = scene
    height, width = face.shape
    samples = 2 * half
    log_ratio = np.empty(samples)
    score = np.empty(samples + 1)
    known = len(background) > 0
    peak = (1 - COLOURS.histogram_share) * (16 / (COLOURS.background_sigma * 2.5066282746)) ** 3
    uniform = COLOURS.uniform_share / BINS**3
    for n in range(count):
        mean[n], variance[n] = 0.0, -1.0
        u, v, nx, ny = contour[n, 0], contour[n, 1], contour[n, 2], contour[n, 3]
        part, outside = parts[n, 0], parts[n, 1]
        cut, behind = False, False
        for k in range(samples):
            distance = (k - half + 0.5) * step
            x = int(np.floor(u + distance * nx + 0.5))
            y = int(np.floor(v + distance * ny + 0.5))
            log_ratio[k] = 0.0
            if x < 2 or y < 2 or x >= width - 2 or y >= height - 2 or not valid[y, x]:
                cut = cut or abs(distance) < 2 * step
                continue
            b = colour_bin(image, y, x)
            here = face_part[face[y, x]] if face[y, x] >= 0 else -1
            if outside >= 0:
                if here in (part, outside):
                    log_ratio[k] = log_inside[part, b] - log_inside[outside, b]
            else:
                if distance > 0 and here >= 0 and distance > 1.5 * step:
                    behind = True
                if behind:
                    continue
                mine = part if distance > 0 or here < 0 else here
                other = log_around[part, b]
                if known:
                    free = views - covered[y, x]
                    if (
                        free >= max(2.0, COLOURS.free_least * views)
                        and agreement[y, x] * views >= COLOURS.agree_share * free - 1
                    ):
                        square = 0.0
                        for c in range(3):
                            off = np.float64(image[y, x, c]) - np.float64(background[y, x, c])
                            square += off * off
                        likely = peak * np.exp(-square / (2 * COLOURS.background_sigma**2))
                        other = np.log(likely + COLOURS.histogram_share * mean_around[b] + uniform)
                log_ratio[k] = log_inside[mine, b] - other
            log_ratio[k] = min(max(log_ratio[k], -COLOURS.clip_nats), COLOURS.clip_nats)
        if cut:
            continue
        explained = 0.0
        for k in range(samples):
            explained -= log_ratio[k]
        best = -1e30
        for j in range(samples + 1):
            distance = (j - half) * step
            x0 = int(np.floor(u + (distance - 1) * nx + 0.5))
            y0 = int(np.floor(v + (distance - 1) * ny + 0.5))
            x1 = int(np.floor(u + (distance + 1) * nx + 0.5))
            y1 = int(np.floor(v + (distance + 1) * ny + 0.5))
            edge = 0.0
            if min(x0, x1, y0, y1) >= 0 and max(x0, x1) < width and max(y0, y1) < height:
                for c in range(3):
                    edge = max(edge, abs(np.float64(smooth[y1, x1, c]) - np.float64(smooth[y0, x0, c])) / 2)
            score[j] = explained / COLOURS.neighbours_alike + COLOURS.edge_weight * min(
                edge / COLOURS.edge_grey, COLOURS.edge_most
            )
            best = max(best, score[j])
            if j < samples:
                explained += 2 * log_ratio[j]
        total, first, second = 0.0, 0.0, 0.0
        for j in range(samples + 1):
            weight = np.exp(score[j] - best)
            distance = (j - half) * step
            total += weight
            first += weight * distance
            second += weight * distance * distance
        first /= total
        mean[n], variance[n] = first, second / total - first * first


@_jit
def add_points(points, count, crossings, twists, half, step, least_sigma, clip, A, b):
    """Add the contour points to the normal equations `A` (M, M) and `b` (M,) under Tukey's weight.

    The first six unknowns are a left perturbation [phi rad, rho m] of the camera; `twists` (M - 6, L, 6) are those of
    the links by the others. Returns the weighted squares and the number of points that had a say.
    """
    _, normal_rate, _, kept, mean, variance = points
    point, link = crossings.point, crossings.link
    unknowns = len(b)
    row = np.empty(unknowns)
    flat = ((2 * half + 1) * step) ** 2 / 12
    floor = least_sigma * least_sigma
    squares, used = 0.0, 0
    for n in range(count):
        if variance[n] < 0:
            continue
        weight = 1 / (variance[n] + floor) - 1 / (flat + floor)
        far = abs(mean[n]) / clip
        if weight <= 0 or far >= 1:
            continue
        weight *= (1 - far * far) ** 2
        a0, a1, a2 = normal_rate[n, 0], normal_rate[n, 1], normal_rate[n, 2]
        m = kept[n]
        X, Y, Z = point[m, 0], point[m, 1], point[m, 2]
        row[0], row[1], row[2] = Y * a2 - Z * a1, Z * a0 - X * a2, X * a1 - Y * a0
        row[3], row[4], row[5] = a0, a1, a2
        for j in range(unknowns - 6):
            row[6 + j] = 0.0
            for i in range(6):
                row[6 + j] += row[i] * twists[j, link[m], i]
        for i in range(unknowns):
            b[i] += weight * row[i] * mean[n]
            for j in range(unknowns):
                A[i, j] += weight * row[i] * row[j]
        squares += weight * mean[n] * mean[n]
        used += 1
    return squares, used
