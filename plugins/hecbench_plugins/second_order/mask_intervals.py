"""The last stage of `render_gn` on masks: the intervals between pixel centres that a sampled mask leaves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hecbench import se3
from hecbench.se3 import Array
from hecbench_plugins.second_order import kernels
from hecbench_plugins.second_order.descent import Trace, draw_counted
from hecbench_plugins.second_order.photometry import Photometry
from hecbench_plugins.second_order.settings import DESCENT, STAGES
from hecbench_plugins.views.pyramid import Level, View


def between_pixels(
    views: Sequence[View], photometry: Photometry, start: Array, trace: Trace, rounds: int = 30
) -> tuple[Array, float]:
    """The pose whose contour passes between the pixel centres where the given masks change.

    A mask of pixels says no more than on which side of the contour each centre lies; a contour that passes between
    the two centres is right wherever it passes. Only violations of these intervals count, besides the coverage with
    a small weight that picks the middle. Returns the pose and the share of violated intervals.
    """
    pose, share = start, 1.0
    for _ in range(rounds):
        _, A, b = photometry(pose)
        A, b = STAGES.coverage_weight * A, STAGES.coverage_weight * b
        violated = total = 0
        for view in views:
            residual, rows = _violations(view.levels[1])
            kernels.row_weights(rows[residual != 0], residual[residual != 0], STAGES.violation_clip_px, A, b)
            violated += int((residual != 0).sum())
            total += len(residual)
        share = violated / max(total, 1)
        move = 0.5 * np.linalg.solve(A + 1e-6 * np.diag(np.diag(A)), b)
        pose = se3.exp(move) @ pose
        trace.iterations += 1
        trace.poses.append(("intervals/1", pose.copy(), share))
        if np.abs(move).max() < DESCENT.small_step:
            break
    return pose, share


def violated_share(views: Sequence[View], pose: Array, trace: Trace) -> float:
    """The share of these intervals that the contour drawn at a pose violates; 1 where it is near none of them."""
    found = [_violations(draw_counted(view, 1, pose, trace))[0] != 0 for view in views]
    return float(np.concatenate(found).mean()) if sum(map(len, found)) else 1.0


def _violations(at: Level) -> tuple[Array, Array]:
    """How far (n,) px contour crossings lie off the nearest change of the mask along their pair, and rows (n, 6)."""
    crossings = at.renderer.crossings
    height, width = at.observed.shape[:2]
    p = crossings.pixels[:, 0]
    y, x = p // width, p % width
    reach = STAGES.mask_reach_px + 1
    inside = (x >= reach) & (x < width - reach - 1) & (y >= reach) & (y < height - reach - 1)
    inside &= ~at.unseen(crossings.pixels)
    chosen = np.flatnonzero(inside & (crossings.parts < 0).any(1) & (np.abs(crossings.slope) <= 1))
    steps = np.arange(-STAGES.mask_reach_px, STAGES.mask_reach_px + 1)
    stride = crossings.pixels[chosen, 1] - p[chosen]
    place = p[chosen, None] + stride[:, None] * steps
    mask = at.observed[..., 3].reshape(-1) > 0.5
    before, after = mask[place], mask[place + stride[:, None]]
    leaves = (crossings.parts[chosen, 0] >= 0)[:, None]
    changes = np.where(leaves, before & ~after, ~before & after)
    t = crossings.t[chosen, None].astype(float)
    off = np.minimum(t - steps, 0) + np.maximum(t - steps - 1, 0)
    off = np.where(changes, off, np.inf)
    nearest = np.abs(off).argmin(1)[:, None]
    residual = np.take_along_axis(off, nearest, 1)[:, 0]
    found = np.isfinite(residual)
    return residual[found], crossings.pose_columns()[chosen][found]
