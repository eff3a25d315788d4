# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: ANN001, ANN201
"""The compiled sums of the renderer methods: colours of the parts, robust cost, normal equations."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

_jit = numba.njit(cache=True, nogil=True)


@_jit
def part_colours(part, observed, box, current, huber, margin, sums, counts):
    """Robust sums of the observed colours of every part over pixels `margin` or more inside it.

    `part` (H, W), `observed` (H, W, C), `current` (P, C) the colours that the Huber weight is measured from. Fills
    `sums` (P, C) and `counts` (P, C), the sums of the weights.
    """
    height, width = part.shape
    channels = sums.shape[1]
    sums[:] = 0.0
    counts[:] = 0.0
    for y in range(max(box[2], margin), min(box[3], height - 1 - margin) + 1):
        for x in range(max(box[0], margin), min(box[1], width - 1 - margin) + 1):
            k = part[y, x]
            if k < 0:
                continue
            pure = True
            for step in range(1, margin + 1):
                pure = pure and part[y, x - step] == k and part[y, x + step] == k
                pure = pure and part[y - step, x] == k and part[y + step, x] == k
            if not pure:
                continue
            for c in range(channels):
                off = abs(observed[y, x, c] - current[k, c])
                weight = 1.0 if off <= huber else huber / off
                sums[k, c] += weight * observed[y, x, c]
                counts[k, c] += weight


@_jit
def cost_change(image, observed, box, background, huber, channels):
    """Huber cost of `image` inside `box` minus the cost of an image that is all background."""
    total = 0.0
    for y in range(box[2], box[3] + 1):
        for x in range(box[0], box[1] + 1):
            for c in range(channels):
                off = abs(image[y, x, c] - observed[y, x, c])
                total += 0.5 * off * off if off <= huber else huber * (off - 0.5 * huber)
                off = abs(background[c] - observed[y, x, c])
                total -= 0.5 * off * off if off <= huber else huber * (off - 0.5 * huber)
    return total


@_jit
def huber_slope(image, observed, huber, out):
    """The derivative of the Huber cost by every value of `image` (H, W, C), into `out`."""
    for y in range(image.shape[0]):
        for x in range(image.shape[1]):
            for c in range(image.shape[2]):
                residual = image[y, x, c] - observed[y, x, c]
                out[y, x, c] = min(max(residual, -huber), huber)


@_jit
def normal_equations(
    pixels, rates, change, columns, image, observed, slope, huber, slot, rows, touched, A, b
):
    """Add J'WJ to `A` (M, M) and -J's to `b` (M,) for the pixels that the crossings change.

    `pixels` (N, 2) flat; `rates` (N, 2) how each pixel mixes; `change` (N, C) colour of p minus colour of q;
    `columns` (N, M) dt by the unknowns; `slope` (H, W, C) the cost's derivative by the sharp image; `slot` (H W,)
    holds -1 before and after; `rows` (K, C, M) and `touched` (K,) are scratch. Pixels that several crossings
    change get the sum of their rows.
    """
    width = image.shape[1]
    channels, unknowns = change.shape[1], columns.shape[1]
    count = 0
    for n in range(len(pixels)):
        for end in range(2):
            rate = rates[n, end]
            if rate == 0.0:
                continue
            pixel = pixels[n, end]
            if slot[pixel] < 0:
                if count == len(touched):
                    continue
                slot[pixel] = count
                touched[count] = pixel
                rows[count] = 0.0
                count += 1
            k = slot[pixel]
            for c in range(channels):
                factor = rate * change[n, c]
                for m in range(unknowns):
                    rows[k, c, m] += factor * columns[n, m]
    for k in range(count):
        pixel = touched[k]
        y, x = pixel // width, pixel % width
        slot[pixel] = -1
        for c in range(channels):
            residual = abs(image[y, x, c] - observed[y, x, c])
            weight = 1.0 if residual <= huber else huber / residual
            for m in range(unknowns):
                b[m] -= rows[k, c, m] * slope[y, x, c]
                weighted = weight * rows[k, c, m]
                for other in range(unknowns):
                    A[m, other] += weighted * rows[k, c, other]
    return count


@_jit
def row_weights(jacobian, residual, clip, A, b):
    """Add scalar residuals (N,) with rows (N, M) under a Huber weight to `A` and `b`; returns the robust cost."""
    cost = 0.0
    unknowns = jacobian.shape[1]
    for n in range(len(residual)):
        off = abs(residual[n])
        weight = 1.0 if off <= clip else clip / off
        cost += 0.5 * off * off if off <= clip else clip * (off - 0.5 * clip)
        for m in range(unknowns):
            weighted = weight * jacobian[n, m]
            b[m] -= weighted * residual[n]
            for other in range(unknowns):
                A[m, other] += weighted * jacobian[n, other]
    return cost


def scratch(
    height: int, width: int, channels: int, unknowns: int
) -> tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.int32]]:
    """`slot`, `rows` and `touched` for `normal_equations`."""
    capacity = max(4096, height * width // 8)
    return (
        np.full(height * width, -1, np.int32),
        np.zeros((capacity, channels, unknowns)),
        np.zeros(capacity, np.int32),
    )
