# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: ANN001, ANN201
"""The compiled loops over the pixels of a drawn robot and its depth picture."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

_jit = numba.njit(fastmath=True, cache=True, nogil=True, boundscheck=False)


class Drawn(NamedTuple):
    """A drawn robot: face and 1/depth of each pixel, the touched box, planes and links of the faces, link poses."""

    face: NDArray[np.int32]
    nearness: NDArray[np.float32]
    box: NDArray[np.int32]
    planes: NDArray[np.float32]
    face_link: NDArray[np.int32]
    camera_T_link: NDArray[np.float32]


@_jit
def add_pixels(drawn, depth, intrinsics, limit, noise, floor, grazing, A, b):
    """Add a view to the normal equations `A` (6, 6) and `b` (6,) of a left perturbation of camera_T_parent.

    The residual of a pixel is the distance of its measured point from the plane of the face drawn there. Its weight is
    one over its variance, by depth noise of ``noise z^2`` and a floor (m), times Tukey's weight for the limit: m, or
    four standard deviations where these are more. Faces seen at a smaller cosine than `grazing` are left out.
    Returns the number of pixels used.
    """
    fx, fy, cx, cy = intrinsics[0], intrinsics[1], intrinsics[2], intrinsics[3]
    count = 0
    row = np.empty(6)
    for y in range(drawn.box[2], drawn.box[3] + 1):
        ry = (y - cy) / fy
        for x in range(drawn.box[0], drawn.box[1] + 1):
            f = drawn.face[y, x]
            z = depth[y, x]
            if f < 0 or z <= 0:
                continue
            rx = (x - cx) / fx
            link = drawn.face_link[f]
            R = drawn.camera_T_link[link]
            p0, p1, p2 = drawn.planes[0, f], drawn.planes[1, f], drawn.planes[2, f]
            nx = R[0, 0] * p0 + R[0, 1] * p1 + R[0, 2] * p2
            ny = R[1, 0] * p0 + R[1, 1] * p1 + R[1, 2] * p2
            nz = R[2, 0] * p0 + R[2, 1] * p1 + R[2, 2] * p2
            along = nx * rx + ny * ry + nz
            if -along < grazing * np.sqrt(rx * rx + ry * ry + 1):
                continue
            drawn_z = 1.0 / drawn.nearness[y, x]
            off = z - drawn_z
            sigma_z = noise * drawn_z * drawn_z
            far = abs(off) / max(limit, 4 * sigma_z)
            if far >= 1:
                continue
            residual = along * off
            variance = (sigma_z * along) ** 2 + floor * floor
            weight = (1 - far * far) ** 2 / variance
            X, Y = rx * drawn_z, ry * drawn_z
            row[0], row[1], row[2] = Y * nz - drawn_z * ny, drawn_z * nx - X * nz, X * ny - Y * nx
            row[3], row[4], row[5] = nx, ny, nz
            for i in range(6):
                b[i] += weight * row[i] * residual
                for j in range(i + 1):
                    A[i, j] += weight * row[i] * row[j]
            count += 1
    for i in range(6):
        for j in range(i):
            A[j, i] = A[i, j]
    return count


@_jit
def compare(face, nearness, box, depth, noise, agreeing, beyond, counts):
    """Count in `counts` (4,) the drawn pixels with depth: agreeing, before the robot, beyond it, and all.

    Agreeing is within `agreeing` m, or four standard deviations up to `beyond` m; beyond is farther than `beyond`.
    Returns the sum of the distances, cut off at `beyond`, a cost.
    """
    cost = 0.0
    for y in range(box[2], box[3] + 1):
        for x in range(box[0], box[1] + 1):
            z = depth[y, x]
            if face[y, x] < 0 or z <= 0:
                continue
            drawn_z = 1.0 / nearness[y, x]
            off, sigmas = z - drawn_z, 4 * noise * drawn_z * drawn_z
            counts[3] += 1
            if abs(off) <= min(max(agreeing, sigmas), beyond):
                counts[0] += 1
            elif off > beyond:
                counts[2] += 1
            elif off < 0:
                counts[1] += 1
            cost += min(abs(off), beyond)
    return cost


@_jit
def relative_offsets(face, nearness, box, depth, limit, out):
    """Write |measured - drawn| / drawn^2 of the drawn pixels within `limit` m into `out` (n,); returns how many."""
    count = 0
    for y in range(box[2], box[3] + 1):
        for x in range(box[0], box[1] + 1):
            z = depth[y, x]
            if face[y, x] < 0 or z <= 0:
                continue
            drawn_z = 1.0 / nearness[y, x]
            if abs(z - drawn_z) < limit:
                out[count] = abs(z - drawn_z) / (drawn_z * drawn_z)
                count += 1
    return count
