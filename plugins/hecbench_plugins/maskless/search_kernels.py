# mypy: disable-error-code="no-untyped-def"
# ruff: noqa: ANN001, ANN201
"""The compiled loops of the search: what many poses cost."""

from __future__ import annotations

import numba
import numpy as np

from hecbench.rendering.kernels import see
from hecbench_plugins.maskless.settings import COLOURS

_jit = numba.njit(fastmath=True, cache=True, nogil=True)


@_jit
def motion_cost(covered_by, foreground, still, valid, box):
    """How badly predicted coverage (N, H, W) explains which pixels differ from the background, px per view.

    A pixel that no view covers must look like background in all. One that some views cover must differ there and
    nowhere else. One that (nearly) all cover says nothing, since its background is never seen; a little against it if
    it is `still` (H, W). `foreground` (N, H, W) are the differences in [0, 1]. Less the cost of a robot that is
    nowhere, so that only pixels in the `box` that some view covers count.
    """
    views = len(covered_by)
    cost = 0.0
    for y in range(box[2], box[3] + 1):
        for x in range(box[0], box[1] + 1):
            if not valid[y, x]:
                continue
            count = 0
            for v in range(views):
                count += covered_by[v, y, x]
            if count >= COLOURS.most_covered * views:
                cost += COLOURS.still_weight * views * still[y, x]
                for v in range(views):
                    cost -= foreground[v, y, x]
            elif count > 0:
                for v in range(views):
                    if covered_by[v, y, x]:
                        cost += COLOURS.covered_weight * (1 - foreground[v, y, x]) - foreground[v, y, x]
    return cost / views


@_jit
def mutual_information(counts):
    """Of a table of counts (M, C), nats times count, less what independent draws would show on average."""
    rows, columns = counts.shape
    by_row, by_column = np.zeros(rows), np.zeros(columns)
    for i in range(rows):
        for j in range(columns):
            by_row[i] += counts[i, j] + COLOURS.empty
            by_column[j] += counts[i, j] + COLOURS.empty
    total = by_row.sum()
    found = 0.0
    for i in range(rows):
        for j in range(columns):
            filled = counts[i, j] + COLOURS.empty
            found += filled * np.log(filled * total / (by_row[i] * by_column[j]))
    return found - 0.5 * (rows - 1) * (columns - 1)


@_jit
def pose_costs(
    scene,
    sight,
    camera_T_parents,
    parent_T_link,
    face_material,
    colour,
    region,
    colours_in_region,
    foreground,
    still,
    valid,
    motion_weight,
    covered,
    counts,
    costs,
):
    """Fill `costs` (n,) of poses (n, 4, 4): mutual information and, where there is a `foreground`, motion, px per view.

    Of the robot drawn in views (N, L, 4, 4): `colour` and `region` (N, H, W), `colours_in_region` (C,) in all of them.
    `covered` (N, H, W), zero, and `counts` (M + 1, C) are scratch.
    """
    face, box = sight.face, sight.box
    views, last = len(parent_T_link), len(counts) - 1
    touched = np.empty(4, np.int32)
    for n in range(len(camera_T_parents)):
        counts[:] = 0.0
        counts[last] = colours_in_region
        touched[0], touched[1], touched[2], touched[3] = face.shape[1], -1, face.shape[0], -1
        for v in range(views):
            see(scene, sight, camera_T_parents[n], parent_T_link[v])
            touched[0], touched[1] = min(touched[0], box[0]), max(touched[1], box[1])
            touched[2], touched[3] = min(touched[2], box[2]), max(touched[3], box[3])
            for y in range(box[2], box[3] + 1):
                for x in range(box[0], box[1] + 1):
                    f = face[y, x]
                    if f < 0:
                        continue
                    covered[v, y, x] = 1
                    if region[v, y, x]:
                        counts[face_material[f], colour[v, y, x]] += 1
                        counts[last, colour[v, y, x]] -= 1
        costs[n] = -mutual_information(counts) / views
        if len(foreground) > 0:
            costs[n] += motion_weight * motion_cost(covered, foreground, still, valid, touched)
        covered[:, touched[2] : touched[3] + 1, touched[0] : touched[1] + 1] = 0
