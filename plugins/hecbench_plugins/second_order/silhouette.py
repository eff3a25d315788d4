"""The first stages of `render_gn`: centroid and area of the masks, then how far the drawn contour lies from theirs."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from hecbench.rendering import Crossings
from hecbench.se3 import Array
from hecbench_plugins.second_order import kernels
from hecbench_plugins.second_order.descent import (
    NormalEquations,
    Trace,
    draw_all,
    draw_counted,
    draw_uncounted,
)
from hecbench_plugins.second_order.settings import STAGES
from hecbench_plugins.views.pyramid import Level, View, signed_distance


def centroid_and_area(views: Sequence[View], start: Array, trace: Trace, rounds: int = 6) -> Array:
    """Translate until centroid and area of the drawn robot match the masks, in closed form per round.

    A robot out of the picture is put on the ray through the mask's centroid.
    """
    pose = start.copy()
    trace.poses.append(("start", start, float("nan")))
    for _ in range(rounds):
        moves = []
        for view in views:
            at = draw_counted(view, 4, pose, trace)
            K = np.asarray(at.renderer.K, float)
            rows, columns = np.nonzero(at.observed[..., 3] > 0.5)
            if not len(rows):
                continue
            aim = np.array([(columns.mean() - K[0, 2]) / K[0, 0], (rows.mean() - K[1, 2]) / K[1, 1], 1.0])
            drawn = at.drawn()
            if drawn.sum() < 20:
                centre = (pose @ view.parent_T_link)[:, :3, 3].mean(0)
                moves.append(aim * max(float(centre[2]), 0.5) - centre)
                continue
            depth = 1 / float(at.renderer.nearness[drawn].mean())
            v, u = np.nonzero(drawn)
            seen = np.array([(u.mean() - K[0, 2]) / K[0, 0], (v.mean() - K[1, 2]) / K[1, 1], 1.0])
            ratio = np.clip(np.sqrt(len(v) / len(rows)), 0.6, 1.6)
            moves.append(aim * depth * ratio - seen * depth)
        if not moves:
            return pose
        move = np.median(moves, 0)
        pose[:3, 3] += move
        if np.linalg.norm(move) < 2e-3:
            break
    trace.poses.append(("centroid", pose.copy(), float("nan")))
    return pose


def silhouette_step(
    views: Sequence[View], level: int, distances: Sequence[NDArray[np.float32]], clip: float, trace: Trace
) -> Callable[[Array], NormalEquations]:
    """Distances of the drawn contour from the masks' contours, px, under a Huber weight beyond `clip`."""

    def step(pose: Array) -> NormalEquations:
        A, b, cost, count = np.zeros((6, 6)), np.zeros(6), 0.0, 0
        trace.renders += len(views)
        levels = draw_all(views, lambda view: draw_uncounted(view, level, pose))
        for at, distance in zip(levels, distances, strict=True):
            residual, jacobian = contour_rows(at.renderer.crossings, outer(at), distance)
            cost += kernels.row_weights(jacobian, residual, clip, A, b)
            count += len(residual)
        if count < STAGES.fewest_crossings:
            return np.inf, A, b
        return cost / count, A, b

    return step


def outer(at: Level) -> NDArray[np.bool_]:
    """Which crossings (C,) lie on the drawn contour, where it can be seen."""
    crossings = at.renderer.crossings
    return np.asarray((crossings.parts < 0).any(1)) & ~at.unseen(crossings.pixels)


def contour_rows(
    crossings: Crossings, outer: NDArray[np.bool_], distance: NDArray[np.float32]
) -> tuple[Array, Array]:
    """Signed distances (n,) px at the contour's crossings and their derivatives (n, 6)."""
    flat = distance.reshape(-1)
    near, far = (flat[crossings.pixels[outer, end]].astype(float) for end in range(2))
    t = crossings.t[outer].astype(float)
    columns = crossings.pose_columns()[outer]
    return near + t * (far - near), (far - near)[:, None] * columns


def distances_at(views: Sequence[View], level: int) -> list[NDArray[np.float32]]:
    """The signed distance fields of the masks."""
    at_level = [view.levels[level] for view in views]
    return [signed_distance(at.observed[..., 3], at.hidden) for at in at_level]
