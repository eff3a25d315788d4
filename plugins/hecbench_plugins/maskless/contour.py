"""Where along its normal does each drawn contour point really lie?

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

from hecbench.rendering import RenderMesh
from hecbench.rendering.undistort import shrunk_intrinsics
from hecbench.samples.spread import evenly
from hecbench.se3 import Array
from hecbench.system import threads
from hecbench_plugins.maskless import contour_kernels
from hecbench_plugins.maskless.contour_buffers import Buffers, KnownColours, KnownScene
from hecbench_plugins.maskless.settings import CONTOUR
from hecbench_plugins.views import scene_background
from hecbench_plugins.views.canvas import Canvas, Images
from hecbench_plugins.views.spool import Spool

Pictures = Sequence[NDArray[np.uint8]] | Spool


@dataclass(frozen=True, eq=False)
class Background:
    """What a fixed camera sees without the robot: (H, W, 3) RGB, and the share (H, W) of the views that show it."""

    image: Images
    agreement: NDArray[np.float32]

    @staticmethod
    def of(images: Spool) -> Background:
        """From photographs of one fixed camera; of many, from some that are spread evenly."""
        chosen = evenly(len(images), CONTOUR.most_for_background)
        image, agreement = scene_background.background(images.subset(chosen.tolist()))
        return Background(np.round(image).astype(np.uint8), agreement)


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
            lambda view: np.asarray(
                cv2.GaussianBlur(self._images[view], (0, 0), CONTOUR.smooth_px), np.uint8
            ),
            count,
        )
        whole = np.asarray(small(255 * self.canvas.valid.astype(np.uint8))) > 254
        background, agreement = np.zeros((0, width, 3), np.uint8), np.zeros((0, width), np.float32)
        if self.background is not None:
            background = np.ascontiguousarray(small(self.background.image), np.uint8)
            agreement = np.ascontiguousarray(small(self.background.agreement), np.float32)
        self._scene = KnownScene(
            np.asarray(cv2.erode(whole.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0),
            background,
            agreement,
            np.zeros((height, width), np.int16),
            count,
        )
        K = shrunk_intrinsics(self.canvas.K, 1 / self.level)
        _, material = np.unique(self.mesh.colours.round(3), axis=0, return_inverse=True)
        self._material = material.reshape(-1).astype(np.int64)
        size, parts = contour_kernels.BINS**3, len(self.mesh.part_names)
        self._one_group = np.zeros(parts, np.int64)
        self._scratch = np.zeros((int(self._material.max()) + 3, size))
        log_inside, log_around = (np.zeros((parts, size), np.float32) for _ in range(2))
        self._colours = KnownColours(log_inside, log_around, np.zeros(size, np.float32))
        self._buffers = [
            Buffers(self.mesh, K, width, height) for _ in range(min(threads.count(), len(self.canvas)))
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
        self._smooth = [np.asarray(cv2.GaussianBlur(image, (0, 0), CONTOUR.smooth_px), np.uint8)]
        self.parent_T_link = parent_T_link[None]

    def colours(self) -> KnownColours:
        """What is known of the colours, for `recall`."""
        inside, around, mean_around = self._colours
        return KnownColours(inside.copy(), around.copy(), mean_around)

    def recall(self, colours: KnownColours) -> None:
        """Forget what was learned since `colours` were asked for."""
        self._colours = colours

    def learn(self, camera_T_parent: Array, spacing: float) -> None:
        """Find the colours of the parts and of what is around them at a pose (4, 4)."""
        self._over_views(camera_T_parent, spacing, 0.0, None)

    def _over_views(
        self,
        camera_T_parent: Array,
        spacing: float,
        radius_m: float,
        compare: Callable[[Buffers, int, int, Images, Images], Any] | None,
    ) -> list[Any]:
        """Draw and compare every view; the colours that are met meanwhile become the known ones afterwards."""
        reach = int(max(CONTOUR.band_px, CONTOUR.half_line * spacing))

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
        covered = np.asarray(sum(buffers.covered for buffers in self._buffers), np.int16)
        self._scene = self._scene._replace(covered=covered)
        known = self._colours
        for counts, group, out in (
            (np.sum([buffers.inside for buffers in self._buffers], 0), self._material, known.inside),
            (np.sum([buffers.around for buffers in self._buffers], 0), self._one_group, known.around),
        ):
            contour_kernels.likelihoods(
                counts, CONTOUR.group_share, group, CONTOUR.fewest_counts, out, self._scratch
            )
        self._colours = known._replace(mean_around=np.exp(known.around).mean(0))
        return [result for _, result in sorted(done, key=lambda row: row[0])]

    def _draw(self, buffers: Buffers, view: int, camera_T_parent: Array, radius_m: float) -> int:
        camera_T_link = camera_T_parent @ self.parent_T_link[view]
        renderer = buffers.renderer
        renderer.draw(camera_T_link)
        flange = self.canvas.flange
        centre = np.zeros(3) if flange is None else camera_T_link[flange, :3, 3]
        radius_m = 0.0 if flange is None else radius_m
        crossings, found = renderer.found
        return int(
            contour_kernels.contour_points(
                crossings, found, renderer.nearness, centre, radius_m, buffers.points
            )
        )

    def _near_robot(self, pictures: Pictures, view: int, buffers: Buffers, out: Images, reach: int) -> Images:
        """A view's picture, of one in a spool only the rows within reach of the robot drawn last."""
        if not isinstance(pictures, Spool):
            return pictures[view]
        _, _, top, bottom = buffers.renderer.box.tolist()
        first, last = (
            max(0, top - reach - CONTOUR.rows_beyond),
            min(len(out), bottom + reach + CONTOUR.rows_beyond),
        )
        if first < last:
            pictures.read_rows(view, first, last, out)
        return out

    def _learn(self, buffers: Buffers, image: Images, count: int, reach: int) -> None:
        renderer = buffers.renderer
        contour_kernels.mark_covered(renderer.face, renderer.box, buffers.covered)
        contour_kernels.count_inside(
            renderer.face, self.mesh.face_part, renderer.box, image, self._scene, buffers.inside
        )
        contour_kernels.count_around(
            buffers.points, count, renderer.face, image, self._scene.valid, reach, buffers.around
        )

    def _compared(
        self,
        buffers: Buffers,
        count: int,
        image: Images,
        smooth: Images,
        spacing: float,
        twists: Array,
    ) -> tuple[Array, Array, float, int, float, int, float]:
        A, b = np.zeros((6 + len(twists),) * 2), np.zeros(6 + len(twists))
        points, renderer, half, step = buffers.points, buffers.renderer, CONTOUR.half_line, float(spacing)
        contour_kernels.line_posteriors(
            points,
            count,
            renderer.face,
            self.mesh.face_part,
            image,
            smooth,
            self._colours,
            self._scene,
            half,
            step,
        )
        clip = CONTOUR.clip_share * half * spacing
        crossings, _ = renderer.found
        squares, used = contour_kernels.add_points(
            points, count, crossings, twists, half, step, CONTOUR.least_sigma_px, clip, A, b
        )
        judged = points.variance[:count] >= 0
        sharp = judged & (points.variance[:count] < CONTOUR.sharp_px**2)
        off_px = np.abs(points.mean[:count][sharp])
        rms_px = float(np.sqrt((off_px**2).mean())) if len(off_px) else np.nan
        share = float((off_px < CONTOUR.centred_px).sum() / max(judged.sum(), 1))
        return A, b, squares, used, share, int(judged.sum()), rms_px
