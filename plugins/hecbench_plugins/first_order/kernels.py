# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: ANN001, ANN201
"""The compiled loops of the first-order methods: the picture within a rectangle, and its derivative by the pose."""

from __future__ import annotations

import math

import numba

_jit = numba.njit(cache=True, nogil=True, boundscheck=False)


@_jit
def paint(face, face_part, colours, pixels, parts, mix, area, fresh, out):
    """Draw the anti-aliased robot into `out` (C, h, w), which shows the rectangle `area` (x0, x1, y0, y1 inclusive).

    `colours` (P + 1, C), the last the background's; `pixels` (N, 2), `parts` (N, 2) and `mix` (N, 4) as in
    `Crossings`. If `fresh`, `out` is filled; otherwise it shows something, to which the robot is added.
    """
    width = face.shape[1]
    channels, background = colours.shape[1], len(colours) - 1
    x0, y0 = area[0], area[2]
    if fresh:
        for c in range(channels):
            out[c] = colours[background, c]
    for y in range(out.shape[1]):
        for x in range(out.shape[2]):
            f = face[y0 + y, x0 + x]
            if f >= 0:
                part = face_part[f]
                for c in range(channels):
                    out[c, y, x] += colours[part, c] - colours[background, c]
    for n in range(len(pixels)):
        p, q = pixels[n, 0], pixels[n, 1]
        for c in range(channels):
            change = colours[parts[n, 1], c] - colours[parts[n, 0], c]
            if change != 0.0:
                out[c, p // width - y0, p % width - x0] += mix[n, 0] * change
                out[c, q // width - y0, q % width - x0] -= mix[n, 2] * change


@_jit
def pull(width, colours, pixels, parts, mix, point, gradient, area, slope, total):
    """Add to `total` (6,) what `slope` (C, h, w), the derivative of a loss by the picture of `area`, says of the pose.

    The pose moves by a left perturbation [phi, rho] of camera_T_robot: a crossing at t moves by dt, and the picture
    by dt times the difference of the two colours.
    """
    x0, y0 = area[0], area[2]
    for n in range(len(pixels)):
        p, q = pixels[n, 0], pixels[n, 1]
        rate = 0.0
        for c in range(colours.shape[1]):
            change = colours[parts[n, 0], c] - colours[parts[n, 1], c]
            if change != 0.0:
                at_p = slope[c, p // width - y0, p % width - x0]
                at_q = slope[c, q // width - y0, q % width - x0]
                rate += change * (mix[n, 1] * at_p + mix[n, 3] * at_q)
        if rate == 0.0:
            continue
        X, Y, Z = point[n, 0], point[n, 1], point[n, 2]
        u, v, w = gradient[n, 0], gradient[n, 1], gradient[n, 2]
        total[0] += rate * (Y * w - Z * v)
        total[1] += rate * (Z * u - X * w)
        total[2] += rate * (X * v - Y * u)
        total[3] += rate * u
        total[4] += rate * v
        total[5] += rate * w


@_jit
def exponential(rotvec, rotation, jacobian):
    """Fill `rotation` (3, 3) with R = Exp(w) and `jacobian` (3, 3) with V(w) (Barfoot 2017, eqs. 7.14 and 7.37)."""
    x, y, z = rotvec[0], rotvec[1], rotvec[2]
    square = x * x + y * y + z * z
    angle = math.sqrt(square)
    if angle < 1e-4:
        first, second, third = 1 - square / 6, 0.5 - square / 24, 1 / 6 - square / 120
    else:
        first = math.sin(angle) / angle
        second = (1 - math.cos(angle)) / square
        third = (1 - first) / square
    hat = ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))
    w = (x, y, z)
    for i in range(3):
        for j in range(3):
            one = 1.0 if i == j else 0.0
            twice = w[i] * w[j] - one * square
            rotation[i, j] = one + first * hat[i][j] + second * twice
            jacobian[i, j] = one + second * hat[i][j] + third * twice


@numba.njit(cache=True, nogil=True, boundscheck=False, fastmath={"reassoc", "contract", "nsz"})
def squared_error(picture, reference, x0, y0, ceiling, slope):
    """Sum of (I - R)^2 over the first channels of `picture` (C, h, w), as many as `reference` (D, H, W) has.

    `x0`, `y0`: where the picture lies in the reference. Values above `ceiling` count as it. Fills `slope` (C, h, w).
    """
    total = 0.0
    slope[len(reference) :] = 0.0
    for c in range(len(reference)):
        for y in range(picture.shape[1]):
            for x in range(picture.shape[2]):
                off = min(picture[c, y, x], ceiling) - reference[c, y0 + y, x0 + x]
                slope[c, y, x] = 2 * off if picture[c, y, x] <= ceiling else 0.0
                total += off * off
    return total


@_jit
def geometry(mask, x0, y0, out):
    """Sums over the pixels of `mask` (h, w), whose first lies at (x0, y0) px of the centroid's origin.

    Fills `out` (4,): w, w x, w y of w = exp(mask) - 1, and sigmoid(mask) - 1/2; pixels at 0 add nothing.
    """
    out[:] = 0.0
    whole, half = math.expm1(1.0), 1 / (1 + math.exp(-1.0)) - 0.5
    for y in range(mask.shape[0]):
        for x in range(mask.shape[1]):
            value = mask[y, x]
            if value == 0.0:
                continue
            weight, area = whole, half
            if value != 1.0:
                weight, area = math.expm1(value), 1 / (1 + math.exp(-value)) - 0.5
            out[0] += weight
            out[1] += weight * (x0 + x)
            out[2] += weight * (y0 + y)
            out[3] += area


@_jit
def geometry_slope(mask, x0, y0, by_sums, slope):
    """The derivative by `mask` (h, w) of a loss that has `by_sums` (4,) by the sums of `geometry`, into `slope`."""
    for y in range(mask.shape[0]):
        for x in range(mask.shape[1]):
            weight = math.exp(mask[y, x])
            odds = by_sums[0] + by_sums[1] * (x0 + x) + by_sums[2] * (y0 + y)
            slope[y, x] = weight * odds + by_sums[3] * weight / (1 + weight) ** 2
