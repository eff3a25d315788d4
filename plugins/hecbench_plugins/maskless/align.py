"""Refinement without masks: where along its normal does each drawn contour point really lie?

After region-based tracking (Prisacariu and Reid 2012, "PWP3D"; Stoiber et al. 2022, "SRT3D"), derived anew: colour
histograms of every part and of what surrounds it give each line across the contour a posterior of the contour's place;
their means pull the camera in a Gauss-Newton step stacked over all views, their variances weigh it. Silhouettes and
boundaries between materials count alike. Where the background is known (a fixed camera, three views or more) it takes
the place of the surroundings' histogram.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.rendering import Renderer, RenderMesh
from hecbench.rendering.undistort import shrunk_intrinsics
from hecbench.se3 import Array
from hecbench.system import threads
from hecbench_plugins.maskless import kernels
from hecbench_plugins.views import scene_background
from hecbench_plugins.views.canvas import Canvas, Images
from hecbench_plugins.views.spool import Spool

Pictures = Sequence[NDArray[np.uint8]] | Spool

HALF_LINE = 8
"""Samples on each side of the contour."""
CORRELATED_POINTS = 30.0
"""Neighbouring contour points of an image that say as much as one alone."""
FEWEST_POINTS = 30
_MOST_FOR_BACKGROUND = 40
"""Photographs that the background is taken from: more change it little, and cost memory and the square of the time."""
_COARSEST_PX = 400
_BAND_PX = 20
_ROWS_BEYOND = 4
"""Rows of a picture read beyond the lines' reach: rounding, and the edge of the contour's last place."""
_LEAST_SIGMA_PX = 0.7
_SMOOTH_PX = 0.8
_CLIP_SHARE = 0.9
_MOST_MOVE_RAD, _MOST_MOVE_M = 0.1, 0.05
_SETTLED = 0.1
"""Standard deviations of the answer that a move must not exceed for the refinement to have converged."""
_DAMPING = 1e-3
_GROUP_SHARE, _FEWEST_COUNTS = 0.3, 50.0
_SHARP_PX, _CENTRED_PX = 2.0, 2.0


@dataclass(frozen=True, eq=False)
class Background:
    """What a fixed camera sees without the robot: (H, W, 3) RGB, and the share (H, W) of the views that show it."""

    image: Images
    agreement: NDArray[np.float32]

    @staticmethod
    def of(images: Spool) -> Background:
        """From photographs of one fixed camera; of many, from some that are spread evenly."""
        chosen = np.unique(np.linspace(0, len(images) - 1, _MOST_FOR_BACKGROUND).round().astype(int))
        image, agreement = scene_background.background(images.subset(chosen.tolist()))
        return Background(np.round(image).astype(np.uint8), agreement)


@dataclass(frozen=True)
class RefinementLevel:
    """A round of refinement: canvas pixels per pixel, pixels between samples, iterations, and with which background."""

    level: int
    spacing: float
    rounds: int
    background: bool


def schedule(width_px: int) -> tuple[tuple[RefinementLevel, ...], RefinementLevel]:
    """The steps from a start decimetres away, and the last one, for a canvas of this width."""
    coarsest = 1
    while width_px / coarsest > _COARSEST_PX:
        coarsest *= 2
    steps = [RefinementLevel(coarsest, 4, 8, True), RefinementLevel(coarsest, 2, 6, True)]
    level = coarsest // 2
    while level > 1:
        steps += [RefinementLevel(level, 2, 4, True), RefinementLevel(level, 1, 5, True)]
        level //= 2
    if coarsest <= 2:
        steps.append(RefinementLevel(1, 2, 4, True))
    return tuple(steps), RefinementLevel(1, 1, 15, False)


class _Buffers:
    """What one thread writes into."""

    def __init__(self, mesh: RenderMesh, K: Array, width: int, height: int) -> None:
        self.renderer = Renderer(mesh, K, width, height)
        histograms = (len(mesh.part_names), kernels.BINS**3)
        self.inside, self.around = (np.zeros(histograms, np.float32) for _ in range(2))
        self.covered = np.zeros((height, width), np.int16)
        self.image, self.smooth = (np.zeros((height, width, 3), np.uint8) for _ in range(2))
        points = 16 * (width + height) + 32768
        self.contour, self.normal_rate = np.zeros((points, 4)), np.zeros((points, 3))
        self.parts, self.kept = np.zeros((points, 2), np.int32), np.zeros(points, np.int32)
        self.mean, self.variance = np.zeros(points), np.zeros(points)


@dataclass(frozen=True, eq=False)
class ContourEquations:
    """The normal equations of one pose: sums, per-view gradients, and how well the lines agree with the contour."""

    A: Array
    b: Array
    view_A: Array
    view_b: Array
    squares: float
    points: int
    view_confirmed_share: Array
    """(N,) share of each view's contour points whose posterior is narrow and centred."""
    view_judged: NDArray[np.int64]
    """(N,) contour points of each view that the image could judge."""
    view_rms_px: Array
    """(N,) rms distance from each view's drawn contour to where its image shows it sharply; NaN where nowhere."""

    @property
    def confirmed_share(self) -> float:
        """Share of all judged contour points that the images confirm."""
        return float(self.view_confirmed_share @ self.view_judged / max(self.view_judged.sum(), 1))


@dataclass(eq=False)
class ContourMatcher:
    """All views of a canvas at one size; remembers the colours found at the last pose it was asked about.

    Attributes:
        canvas: at full size.
        level: canvas pixels per pixel.
        background: of the full canvas, None where it is not known.
        parent_T_link: (N, L, 4, 4) m, the canvas' until somebody corrects the joints.
        renders: pictures drawn so far.
    """

    mesh: RenderMesh
    canvas: Canvas
    level: int
    background: Background | None
    parent_T_link: Array = field(init=False)
    renders: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        import cv2

        self.parent_T_link = self.canvas.parent_T_link
        height, width = (size // self.level for size in self.canvas.valid.shape)

        def small(picture: NDArray[Any]) -> NDArray[Any]:
            if self.level == 1:
                return picture
            return np.asarray(cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA))

        full, count = self.canvas.images, len(self.canvas)
        self._images: Sequence[NDArray[np.uint8]] | Spool = (
            full if self.level == 1 else Spool.of(lambda view: small(full[view]), count)
        )
        self._smooth: Pictures = Spool.of(
            lambda view: np.asarray(cv2.GaussianBlur(self._images[view], (0, 0), _SMOOTH_PX), np.uint8), count
        )
        whole = np.asarray(small(255 * self.canvas.valid.astype(np.uint8))) > 254
        self._valid = np.asarray(cv2.erode(whole.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0)
        self._background = np.zeros((0, width, 3), np.uint8)
        self._agreement = np.zeros((0, width), np.float32)
        if self.background is not None:
            self._background = np.ascontiguousarray(small(self.background.image), np.uint8)
            self._agreement = np.ascontiguousarray(small(self.background.agreement), np.float32)
        K = shrunk_intrinsics(self.canvas.K, 1 / self.level)
        _, material = np.unique(self.mesh.colours.round(3), axis=0, return_inverse=True)
        self._material = material.reshape(-1).astype(np.int64)
        size, parts = kernels.BINS**3, len(self.mesh.part_names)
        self._one_group = np.zeros(parts, np.int64)
        self._scratch = np.zeros((int(self._material.max()) + 3, size))
        self._log_inside, self._log_around = (np.zeros((parts, size), np.float32) for _ in range(2))
        self._mean_around = np.zeros(size, np.float32)
        self._covered = np.zeros((height, width), np.int16)
        self._buffers = [
            _Buffers(self.mesh, K, width, height) for _ in range(min(threads.count(), len(self.canvas)))
        ]

    def __call__(
        self,
        camera_T_parent: Array,
        spacing: float,
        *,
        twists: Sequence[Array] = (),
        radius_m: float = 0.0,
    ) -> ContourEquations:
        """Compare the contours drawn at a pose with the images by the known colours; learns those of this pose.

        Args:
            camera_T_parent: (4, 4).
            spacing: px between samples of a line.
            twists: per view, (M - 6, L, 6) left twists in the camera frame of the links by further unknowns.
            radius_m: contour points seen within this distance of the flange are left out.
        """
        extra = twists if len(twists) else [np.zeros((0, 1, 6))] * len(self.canvas)
        rows = self._over_views(
            camera_T_parent,
            spacing,
            radius_m,
            lambda buffers, view, count, image, smooth: self._compared(
                buffers, count, image, smooth, spacing, extra[view]
            ),
        )
        A, b, squares, used, sharp, judged, rms = (np.array(column) for column in zip(*rows, strict=True))
        return ContourEquations(
            A.sum(0), b.sum(0), A, b, float(squares.sum()), int(used.sum()), sharp, judged, rms
        )

    def show(self, image: NDArray[np.uint8], parent_T_link: Array) -> None:
        """Look at another picture (H, W, 3) of the canvas' size from now on, its links at (L, 4, 4).

        For streams, one view at full size; the colours that are known stay.
        """
        import cv2

        self._images = [image]
        self._smooth = [np.asarray(cv2.GaussianBlur(image, (0, 0), _SMOOTH_PX), np.uint8)]
        self.parent_T_link = parent_T_link[None]

    def colours(self) -> tuple[NDArray[np.float32], ...]:
        """What is known of the colours, for `recall`."""
        return self._log_inside.copy(), self._log_around.copy(), self._mean_around

    def recall(self, colours: tuple[NDArray[np.float32], ...]) -> None:
        """Forget what was learned since `colours` were asked for."""
        self._log_inside, self._log_around, self._mean_around = colours

    def learn(self, camera_T_parent: Array, spacing: float) -> None:
        """Find the colours of the parts and of what is around them at a pose (4, 4)."""
        self._over_views(camera_T_parent, spacing, 0.0, None)

    def _over_views(
        self,
        camera_T_parent: Array,
        spacing: float,
        radius_m: float,
        compare: Callable[[_Buffers, int, int, Images, Images], Any] | None,
    ) -> list[Any]:
        """Draw and compare every view; the colours that are met meanwhile become the known ones afterwards."""
        reach = int(max(_BAND_PX, HALF_LINE * spacing))

        def share(number: int) -> list[tuple[int, Any]]:
            buffers, done = self._buffers[number], []
            buffers.inside[:], buffers.around[:], buffers.covered[:] = 0, 0, 0
            for view in range(number, len(self.canvas), len(self._buffers)):
                count = self._draw(buffers, view, camera_T_parent, radius_m)
                image = self._near_robot(self._images, view, buffers, buffers.image, reach)
                if compare is not None:
                    smooth = self._near_robot(self._smooth, view, buffers, buffers.smooth, reach)
                    done.append((view, compare(buffers, view, count, image, smooth)))
                self._learn(buffers, image, count, reach)
            return done

        done = [row for rows in threads.each(share, range(len(self._buffers))) for row in rows]
        self.renders += len(self.canvas)
        self._covered = np.asarray(sum(buffers.covered for buffers in self._buffers), np.int16)
        inside = np.sum([buffers.inside for buffers in self._buffers], 0)
        around = np.sum([buffers.around for buffers in self._buffers], 0)
        for counts, group, out in (
            (inside, self._material, self._log_inside),
            (around, self._one_group, self._log_around),
        ):
            kernels.likelihoods(counts, _GROUP_SHARE, group, _FEWEST_COUNTS, out, self._scratch)
        self._mean_around = np.exp(self._log_around).mean(0)
        return [result for _, result in sorted(done, key=lambda row: row[0])]

    def _draw(self, buffers: _Buffers, view: int, camera_T_parent: Array, radius_m: float) -> int:
        camera_T_link = camera_T_parent @ self.parent_T_link[view]
        renderer = buffers.renderer
        renderer.draw(camera_T_link)
        flange = self.canvas.flange
        centre = np.zeros(3) if flange is None else camera_T_link[flange, :3, 3]
        seen = renderer.crossings
        room = len(buffers.mean)
        return int(
            kernels.contour_points(
                seen.pixels[:room],
                seen.parts[:room],
                seen.t[:room],
                seen.slope[:room],
                seen.point[:room],
                seen.gradient[:room],
                renderer.nearness,
                centre,
                radius_m if flange is not None else 0.0,
                buffers.contour,
                buffers.normal_rate,
                buffers.parts,
                buffers.kept,
            )
        )

    def _near_robot(
        self, pictures: Pictures, view: int, buffers: _Buffers, out: Images, reach: int
    ) -> Images:
        """A view's picture, of one in a spool only the rows within reach of the robot drawn last."""
        if not isinstance(pictures, Spool):
            return pictures[view]
        _, _, top, bottom = buffers.renderer.box.tolist()
        first, last = max(0, top - reach - _ROWS_BEYOND), min(len(out), bottom + reach + _ROWS_BEYOND)
        if first < last:
            pictures.read_rows(view, first, last, out)
        return out

    def _learn(self, buffers: _Buffers, image: Images, count: int, reach: int) -> None:
        renderer = buffers.renderer
        kernels.mark_covered(renderer.face, renderer.box, buffers.covered)
        kernels.count_inside(
            renderer.face,
            self.mesh.face_part,
            renderer.box,
            image,
            self._valid,
            self._background,
            self._covered,
            len(self.canvas),
            buffers.inside,
        )
        kernels.count_around(
            buffers.contour, buffers.parts, count, renderer.face, image, self._valid, reach, buffers.around
        )

    def _compared(
        self,
        buffers: _Buffers,
        count: int,
        image: Images,
        smooth: Images,
        spacing: float,
        twists: Array,
    ) -> tuple[Array, Array, float, int, float, int, float]:
        A, b = np.zeros((6 + len(twists),) * 2), np.zeros(6 + len(twists))
        kernels.line_posteriors(
            buffers.contour,
            buffers.parts,
            count,
            buffers.renderer.face,
            self.mesh.face_part,
            image,
            smooth,
            self._valid,
            self._log_inside,
            self._log_around,
            self._mean_around,
            self._background,
            self._agreement,
            self._covered,
            len(self.canvas),
            HALF_LINE,
            float(spacing),
            buffers.mean,
            buffers.variance,
        )
        seen = buffers.renderer.crossings
        clip = _CLIP_SHARE * HALF_LINE * spacing
        squares, used = kernels.add_points(
            count,
            buffers.normal_rate,
            seen.point,
            seen.link,
            buffers.kept,
            buffers.mean,
            buffers.variance,
            twists,
            HALF_LINE,
            float(spacing),
            _LEAST_SIGMA_PX,
            clip,
            A,
            b,
        )
        judged = buffers.variance[:count] >= 0
        sharp = judged & (buffers.variance[:count] < _SHARP_PX**2)
        off_px = np.abs(buffers.mean[:count][sharp])
        rms_px = float(np.sqrt((off_px**2).mean())) if len(off_px) else np.nan
        share = float((off_px < _CENTRED_PX).sum() / max(judged.sum(), 1))
        return A, b, squares, used, share, int(judged.sum()), rms_px


@dataclass(frozen=True, eq=False)
class Refined:
    """Where a refinement ended, with the comparison there."""

    camera_T_parent: Array
    last: ContourEquations
    iterations: int
    converged: bool


def refine(
    lines: ContourMatcher, camera_T_parent: Array, step: RefinementLevel, sigmas: float = _SETTLED
) -> Refined:
    """Damped Gauss-Newton steps of limited length at one size, until a move is `sigmas` standard deviations long."""
    lines.learn(camera_T_parent, step.spacing)
    found = lines(camera_T_parent, step.spacing)
    return refine_further(lines, Refined(camera_T_parent, found, 0, False), step, 0.0, sigmas)


def refine_further(
    lines: ContourMatcher, start: Refined, step: RefinementLevel, radius_m: float, sigmas: float = _SETTLED
) -> Refined:
    """The same from a comparison that was made within `radius_m` already, by the colours found there."""
    pose, found, converged, iteration = start.camera_T_parent, start.last, False, 0
    for iteration in range(1, step.rounds + 1):  # noqa: B007 the number of the last is told
        if found.points < FEWEST_POINTS:
            break
        move = np.linalg.solve(found.A + np.diag(_DAMPING * np.diag(found.A) + 1e-9), found.b)
        pose = se3.exp(limited(move)) @ pose
        found = lines(pose, step.spacing, radius_m=radius_m)
        converged = settled(found, move, sigmas)
        if converged:
            break
    return Refined(pose, found, start.iterations + iteration, converged)


def settled(found: ContourEquations, move: NDArray[Any], sigmas: float = _SETTLED) -> bool:
    """Whether a move (6 + ...) is shorter than so many standard deviations of what the images can tell."""
    return float(move @ found.A @ move) < CORRELATED_POINTS * sigmas**2


def limited(move: NDArray[Any]) -> Array:
    """The move (6 + ...) shortened until neither turn nor shift of the camera is too long to be believed."""
    turn, shift = float(np.linalg.norm(move[:3])), float(np.linalg.norm(move[3:6]))
    return np.asarray(move * min(1.0, _MOST_MOVE_RAD / max(turn, 1e-12), _MOST_MOVE_M / max(shift, 1e-12)))
