"""The stages of `render_gn`: centroid and area, silhouette, photometry, sub-pixel edges.

All turn camera_T_parent by left perturbations [phi rad, rho m] in the camera frame and stack every view.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.rendering import Crossings
from hecbench_plugins import render_kernels as kernels
from hecbench_plugins.render_views import Level, View, signed_distance

Array = NDArray[np.float64]
Step = tuple[float, Array, Array]
"""Cost, J'WJ (6, 6) and -J'Wr (6,)."""

_SMALL_STEP = 2e-6
_FEWEST_CROSSINGS = 30
_LEAST_CONTRAST = 0.12
_EDGE_REACH_PX = 1.5


@dataclass
class Trace:
    """What happened on the way."""

    renders: int = 0
    iterations: int = 0
    poses: list[tuple[str, Array, float]] = field(default_factory=list)
    """Stage, camera_T_parent and cost of every accepted step."""


def draw(view: View, level: int, camera_T_parent: Array, trace: Trace) -> Level:
    """Draw a view at a pose; returns its level."""
    at = view.levels[level]
    at.renderer.draw(camera_T_parent @ view.parent_T_link)
    trace.renders += 1
    return at


def centroid_and_area(views: Sequence[View], start: Array, trace: Trace, rounds: int = 6) -> Array:
    """Translate until centroid and area of the drawn robot match the masks, in closed form per round.

    A robot out of the picture is put on the ray through the mask's centroid.
    """
    pose = start.copy()
    for _ in range(rounds):
        moves = []
        for view in views:
            at = draw(view, 4, pose, trace)
            K = np.asarray(at.renderer.K, float)
            rows, columns = np.nonzero(at.observed[..., 3] > 0.5)
            if not len(rows):
                continue
            aim = np.array([(columns.mean() - K[0, 2]) / K[0, 0], (rows.mean() - K[1, 2]) / K[1, 1], 1.0])
            drawn = at.renderer.face >= 0
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
) -> Callable[[Array], Step]:
    """Distances of the drawn contour from the masks' contours, px, under a Huber weight beyond `clip`."""

    def step(pose: Array) -> Step:
        A, b, cost, count = np.zeros((6, 6)), np.zeros(6), 0.0, 0
        for view, distance in zip(views, distances, strict=True):
            at = draw(view, level, pose, trace)
            crossings = at.renderer.crossings
            outer = (crossings.parts < 0).any(1)
            residual, jacobian = contour_rows(crossings, outer, distance)
            cost += kernels.row_weights(jacobian, residual, clip, A, b)
            count += len(residual)
        if count < _FEWEST_CROSSINGS:
            return np.inf, A, b
        return cost / count, A, b

    return step


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
    return [signed_distance(view.levels[level].observed[..., 3]) for view in views]


@dataclass(eq=False)
class Photometry:
    """The picture of flat parts on a flat background against the observed one, one colour per part and view.

    Attributes:
        views, level: what is compared.
        channels: 3 compares colours, 1 the coverage with the mask.
        huber: from which residual on a pixel counts less.
    """

    views: Sequence[View]
    level: int
    channels: slice
    huber: float
    trace: Trace
    fit_colours: bool = True

    def __post_init__(self) -> None:
        self._colours: list[NDArray[np.float32] | None] = [None] * len(self.views)
        count = self.channels.stop - self.channels.start
        self._scratch = [
            kernels.scratch(*view.levels[self.level].observed.shape[:2], count, 6) for view in self.views
        ]

    def colours(self, index: int, at: Level) -> NDArray[np.float32]:
        """Colours (P, 3) of the parts in one view at the drawn pose; unseen parts follow the seen ones."""
        mesh = at.renderer.mesh
        nominal = mesh.colours
        if not self.fit_colours:
            return nominal.astype(np.float32)
        known = self._colours[index]
        part, box = at.renderer.part, at.renderer.box
        sums, counts = np.zeros_like(nominal), np.zeros_like(nominal)
        current = nominal if known is None else known.astype(float)
        for _ in range(3 if known is None else 1):
            width = 10.0 if known is None else max(self.huber, 0.05)
            kernels.part_colours(part, at.observed, box, current, width, sums, counts)
            seen = counts > 10
            current = np.where(seen, sums / np.maximum(counts, 1), _follow(nominal, sums, counts, seen))
            known = current.astype(np.float32)
        self._colours[index] = known
        assert known is not None
        return known

    def __call__(self, pose: Array) -> Step:
        A, b, cost = np.zeros((6, 6)), np.zeros(6), 0.0
        crossed = 0
        for index, view in enumerate(self.views):
            at = draw(view, self.level, pose, self.trace)
            renderer, background = at.renderer, at.background
            table = np.zeros((len(renderer.mesh.part_names) + 1, 4), np.float32)
            coverage_only = self.channels.start == 3
            table[:-1, :3] = renderer.mesh.colours if coverage_only else self.colours(index, at)
            table[:-1, 3] = 1
            table[-1] = background
            image = renderer.image(table[:-1, :3], background[:3])[..., self.channels]
            observed = at.observed[..., self.channels]
            cost += kernels.cost_change(
                image, observed, renderer.painted, background[self.channels], self.huber, image.shape[2]
            )
            crossings = renderer.crossings
            crossed += len(crossings)
            change = (table[crossings.parts[:, 0]] - table[crossings.parts[:, 1]])[:, self.channels]
            kernels.normal_equations(
                crossings.pixels,
                crossings.mix[:, 1::2],
                change,
                crossings.pose_columns(),
                image,
                observed,
                self.huber,
                *self._scratch[index],
                A,
                b,
            )
        return (cost if crossed >= _FEWEST_CROSSINGS else np.inf), A, b


def _follow(nominal: Array, sums: Array, counts: Array, seen: NDArray[np.bool_]) -> Array:
    """Nominal colours under the gain and offset per channel that fit the seen parts."""
    fitted = nominal.copy()
    for c in range(nominal.shape[1]):
        use = seen[:, c]
        weight = np.sqrt(counts[use, c])
        if use.sum() >= 3 and np.ptp(nominal[use, c]) > 0.1:
            design = np.stack([nominal[use, c], np.ones(use.sum())], 1) * weight[:, None]
            gain, offset = np.linalg.lstsq(design, weight * sums[use, c] / counts[use, c], rcond=None)[0]
            fitted[:, c] = np.clip(gain * nominal[:, c] + offset, 0, 1)
    return fitted


@dataclass(frozen=True)
class Descent:
    """Where a descent ended: `ended` is "converged", "stalled" or "iterations"."""

    pose: Array
    cost: float
    normal: Array
    ended: str


def descend(
    step: Callable[[Array], Step],
    start: Array,
    iterations: int,
    trace: Trace,
    stage: str,
    small: float = _SMALL_STEP,
) -> Descent:
    """Levenberg-Marquardt with Marquardt's scaling; a step that does not lower the cost is taken back."""
    damping, pose = 1e-3, start
    cost, A, b = step(pose)
    if not np.isfinite(cost):
        return Descent(pose, cost, A, "stalled")
    for _ in range(iterations):
        trace.iterations += 1
        move = np.linalg.solve(A + np.diag(damping * np.diag(A) + 1e-9 * np.trace(A) / 6 + 1e-12), b)
        size = float(np.linalg.norm(move))
        if size > 0.5:
            move *= 0.5 / size
        proposed = se3.exp(move) @ pose
        new_cost, new_A, new_b = step(proposed)
        if new_cost < cost:
            pose, cost, A, b = proposed, new_cost, new_A, new_b
            damping = max(0.2 * damping, 1e-7)
            trace.poses.append((stage, pose.copy(), cost))
            if np.abs(move).max() < small:
                return Descent(pose, cost, A, "converged")
        else:
            if np.abs(move).max() < 10 * small:
                return Descent(pose, cost, A, "converged")
            damping *= 10
            if damping > 1e4:
                return Descent(pose, cost, A, "stalled")
    return Descent(pose, cost, A, "iterations")


def edge_rows(view: View, at: Level) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Sub-pixel places of the picture's own edges beside the drawn ones: residuals (n,) px, rows (n, 6), outer.

    Between colours a and b found two pixels to either side, the pixels in between tell by their share of a where
    the edge lies (moment preservation: Tabatabai and Mitchell 1984). Blur, gain and offset do not move it.
    """
    crossings = at.renderer.crossings
    height, width = view.raw.shape[:2]
    p = crossings.pixels[:, 0]
    stride = crossings.pixels[:, 1] - p
    y, x = p // width, p % width
    inside = (x >= 3) & (x < width - 4) & (y >= 3) & (y < height - 4)
    flat = view.raw.reshape(-1, 3)
    part = at.renderer.part.reshape(-1)
    chosen = np.flatnonzero(inside & (np.abs(crossings.slope) <= 1))
    p, stride = p[chosen], stride[chosen]
    line = flat[p[:, None] + stride[:, None] * np.arange(-2, 4)].astype(float)
    parts = part[p[:, None] + stride[:, None] * np.arange(-2, 4)]
    clean = (parts[:, :3] == parts[:, 2:3]).all(1) & (parts[:, 3:] == parts[:, 3:4]).all(1)
    contrast = line[:, 0] - line[:, 5]
    power = (contrast**2).sum(1)
    share = ((line[:, 1:5] - line[:, 5:6]) * contrast[:, None]).sum(2) / np.maximum(power, 1e-9)[:, None]
    monotone = (share > -0.25).all(1) & (share < 1.25).all(1)
    found = np.clip(share, 0, 1).sum(1) - 1.5
    residual = crossings.t[chosen] - found
    good = clean & monotone & (power > _LEAST_CONTRAST**2) & (np.abs(residual) < _EDGE_REACH_PX)
    rows = crossings.pose_columns()[chosen][good]
    outer = (crossings.parts[chosen][good] < 0).any(1)
    return residual[good], rows, outer
