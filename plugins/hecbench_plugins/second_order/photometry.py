"""The photometry of `render_gn`: the picture of flat parts, one colour per part and view, against the observed one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench.rendering import Crossings
from hecbench.se3 import Array
from hecbench_plugins.second_order import kernels
from hecbench_plugins.second_order.descent import NormalEquations, Trace, draw_all, draw_uncounted
from hecbench_plugins.second_order.settings import STAGES
from hecbench_plugins.views.pyramid import Level, View


@dataclass(frozen=True, eq=False)
class PartColours:
    """RGB (P, 3) of the parts of one view, which (P,) of them were seen, and in how many pixels (P, 3)."""

    table: NDArray[np.float32]
    seen: NDArray[np.bool_]
    pixels: Array


@dataclass(eq=False)
class Photometry:
    """The picture of flat parts on a flat background against the observed one, one colour per part and view.

    Attributes:
        views, level: what is compared.
        channels: 0 to 3 compares colours, 3 to 4 the coverage with the mask.
        huber: from which residual on a pixel counts less.
        blur_px: sigma by which the drawn picture is blurred before it is compared.
    """

    views: Sequence[View]
    level: int
    channels: slice
    huber: float
    trace: Trace
    blur_px: float = 0.0
    unknowns: int = field(default=6, init=False)
    """Columns of the normal equations; the first six are the pose."""

    def __post_init__(self) -> None:
        self.fitted: list[PartColours | None] = [None] * len(self.views)
        shapes = [view.levels[self.level].observed.shape[:2] for view in self.views]
        count = self.channels.stop - self.channels.start
        self._scratch = [kernels.scratch(shape[0], shape[1], count, self.unknowns) for shape in shapes]
        self._slopes = [np.zeros((*shape, count), np.float32) for shape in shapes]
        self.residuals: list[NDArray[np.float32]] = [np.zeros(0, np.float32)] * len(self.views)
        """Of every value of the last pictures."""

    def colours(self, index: int, at: Level) -> NDArray[np.float32]:
        """Colours (P, 3) of the parts in one view at the drawn pose; unseen parts follow the seen ones."""
        nominal = at.renderer.mesh.colours
        known = self.fitted[index]
        part, box = at.renderer.part, at.renderer.box
        if at.hidden is not None:
            part = np.where(at.hidden, np.int32(-1), part)
        sums, counts = np.zeros_like(nominal), np.zeros_like(nominal)
        margin = 1 + int(np.ceil(2 * self.blur_px))
        for _ in range(3 if known is None else 1):
            width = STAGES.any_colour if known is None else max(self.huber, 0.05)
            current = nominal if known is None else known.table.astype(float)
            kernels.part_colours(part, at.observed, box, current, width, margin, sums, counts)
            seen = counts > STAGES.fewest_pure
            table = np.where(seen, sums / np.maximum(counts, 1), _follow(nominal, sums, counts, seen))
            known = PartColours(table.astype(np.float32), np.asarray(seen.all(1)), counts.copy())
        self.fitted[index] = known
        assert known is not None
        return known.table

    def __call__(self, pose: Array) -> NormalEquations:
        A, b = np.zeros((self.unknowns, self.unknowns)), np.zeros(self.unknowns)
        cost, crossed = 0.0, 0
        self.trace.renders += len(self.views)
        levels = draw_all(self.views, lambda view: self.draw(view, pose))
        for index, (view, at) in enumerate(zip(self.views, levels, strict=True)):
            crossed += len(at.renderer.crossings)
            cost += self._add(index, at, self.columns(view, at.renderer.crossings, pose), A, b)
        return (cost if crossed >= STAGES.fewest_crossings else np.inf), A, b

    def draw(self, view: View, pose: Array) -> Level:
        """Draw one view."""
        return draw_uncounted(view, self.level, pose)

    def columns(self, view: View, crossings: Crossings, pose: Array) -> Array:
        """How the crossings move by the unknowns (C, unknowns), px."""
        return crossings.pose_columns()

    def _add(self, index: int, at: Level, columns: Array, A: Array, b: Array) -> float:
        renderer, background = at.renderer, at.background
        table = np.zeros((len(renderer.mesh.part_names) + 1, 4), np.float32)
        table[:-1, :3] = renderer.mesh.colours if self.channels.start == 3 else self.colours(index, at)
        table[:-1, 3] = 1
        table[-1] = background
        image = renderer.image(table[:-1, :3], background[:3])[..., self.channels]
        observed = at.observed[..., self.channels]
        box, slope = self.box(at), self._slopes[index]
        if self.blur_px > 0:
            from scipy import ndimage

            sigma = (self.blur_px, self.blur_px, 0)
            area = (slice(box[2], box[3] + 1), slice(box[0], box[1] + 1))
            blurred = image.copy()
            blurred[area] = ndimage.gaussian_filter(image[area], sigma, mode="nearest")
            image = blurred
            self._hide(at, image)
            kernels.huber_slope(image[area], observed[area], self.huber, slope[area])
            slope[area] = ndimage.gaussian_filter(slope[area], sigma, mode="constant")
        else:
            self._hide(at, image)
            area = (slice(box[2], box[3] + 1), slice(box[0], box[1] + 1))
            kernels.huber_slope(image[area], observed[area], self.huber, slope[area])
        self.residuals[index] = image[area] - observed[area]
        crossings = renderer.crossings
        change = _change(at, table)[:, self.channels]
        kernels.normal_equations(
            crossings.pixels,
            crossings.mix[:, 1::2],
            change,
            columns,
            image,
            observed,
            slope,
            self.huber,
            *self._scratch[index],
            A,
            b,
        )
        return float(
            kernels.cost_change(image, observed, box, background[self.channels], self.huber, image.shape[2])
        )

    def colour_information(self) -> Array:
        """Sum (6, 6) of g g' / n over parts and channels: what their colours' errors add to the right-hand side.

        g is the derivative of J'r by a colour, n the number of pixels that the colour is the mean of; in units of
        the noise's variance.
        """
        total = np.zeros((6, 6))
        for view, fitted in zip(self.views, self.fitted, strict=True):
            if fitted is None:
                continue
            crossings = view.levels[self.level].renderer.crossings
            table = np.vstack([fitted.table, view.levels[self.level].background[:3]]).astype(float)
            change = _change(view.levels[self.level], table)
            pixels, slot = np.unique(crossings.pixels, return_inverse=True)
            slot = slot.reshape(crossings.pixels.shape)
            rows = np.zeros((len(pixels), 3, 6))
            share = np.zeros((len(pixels), len(table)))
            columns = crossings.pose_columns()
            share[slot, crossings.parts] = 1.0
            for end in range(2):
                own, other = crossings.parts[:, end], crossings.parts[:, 1 - end]
                rate, taken = crossings.mix[:, 2 * end + 1], crossings.mix[:, 2 * end]
                np.add.at(rows, slot[:, end], (rate[:, None] * change)[:, :, None] * columns[:, None])
                np.add.at(share, (slot[:, end], other), taken)
                np.add.at(share, (slot[:, end], own), -taken)
            g = np.einsum("xp,xcm->pcm", share[:, :-1], rows)[fitted.seen]
            n = fitted.pixels[fitted.seen]
            total += np.einsum("pcm,pck,pc->mk", g, g, 1 / n)
        return total

    def noise(self) -> float:
        """Standard deviation of the last residuals around the robot, larger when neighbours resemble each other.

        Residuals correlated by r along rows and columns tell as much as a share (1 - r)^2 / (1 + r)^2 of them.
        """
        squares = sum(float((residual**2).sum()) for residual in self.residuals)
        count = sum(residual.size for residual in self.residuals)
        beside = sum(float((r[:, 1:] * r[:, :-1]).sum() + (r[1:] * r[:-1]).sum()) / 2 for r in self.residuals)
        r = float(np.clip(beside / max(squares, 1e-30), 0, 0.9))
        return float(np.sqrt(squares / max(count - 6, 1)) * (1 + r) / (1 - r))

    def _hide(self, at: Level, image: NDArray[np.float32]) -> None:
        """Where something may hide the robot the drawn picture is background, as the observed one is there."""
        if at.hidden is not None:
            image[at.hidden] = at.background[self.channels]

    def box(self, at: Level) -> NDArray[np.int32]:
        """Left, right, top, bottom px of what was drawn last and compared, blur included."""
        if self.blur_px == 0:
            return np.asarray(at.renderer.painted)
        by, shape = int(np.ceil(4 * self.blur_px)), at.observed.shape
        left, right, top, bottom = at.renderer.painted
        return np.array(
            [
                max(0, left - by),
                min(shape[1] - 1, right + by),
                max(0, top - by),
                min(shape[0] - 1, bottom + by),
            ],
            np.int32,
        )


def _change(at: Level, table: NDArray[Any]) -> NDArray[Any]:
    """Colour of p minus colour of q of every crossing, 0 where it cannot be seen."""
    crossings = at.renderer.crossings
    change = table[crossings.parts[:, 0]] - table[crossings.parts[:, 1]]
    change[at.unseen(crossings.pixels)] = 0
    return np.asarray(change)


def tone_exponent(photometry: Photometry) -> float:
    """The exponent of the pictures' tone curve, by the colours found for the parts against the model's own.

    1 when the two are not related by gain and exponent, as when the robot is painted otherwise.
    """
    nominal, found = [], []
    for view, colours in zip(photometry.views, photometry.fitted, strict=True):
        if colours is not None:
            table, seen = view.levels[photometry.level].renderer.mesh.colours, colours.seen
            nominal.append(table[seen])
            found.append(colours.table[seen])
    x, y = np.concatenate(nominal), np.concatenate(found)
    use = (x > STAGES.darkest) & (y > STAGES.darkest)
    if use.sum() < 3 * STAGES.fewest_parts or np.ptp(np.log(x[use])) < 0.5:
        return 1.0
    exponent, gain = np.polyfit(np.log(x[use]), np.log(y[use]), 1)
    misfit = np.std(np.log(y[use]) - exponent * np.log(x[use]) - gain)
    trusted = misfit < STAGES.tone_misfit and abs(exponent - 1) > STAGES.tone_misfit
    return float(exponent) if trusted else 1.0


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
