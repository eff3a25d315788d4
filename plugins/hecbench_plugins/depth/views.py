"""Depth pictures of a recording as a pinhole camera sees them, at every size, and the robot drawn in them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError, Refusal
from hecbench.recording import Recording
from hecbench.rendering import Renderer, RenderMesh
from hecbench.robots.posed import PosedRobot
from hecbench.se3 import Array
from hecbench.system import threads
from hecbench_plugins.depth import kernels
from hecbench_plugins.depth.settings import DepthSettings, Stage
from hecbench_plugins.views.canvas import Rectification
from hecbench_plugins.views.pyramid import mesh_at, meshes_by_level, photographed_robot

Depth = NDArray[np.float32]
Result = TypeVar("Result")

FEWEST_VIEWS = 3
"""Of a fixed camera, from which on the background of a pixel is known."""
_BACKGROUND = 0.7
"""Quantile of a pixel's depths that is its background: the robot hides it in fewer views, and noise has two sides."""


@dataclass(frozen=True)
class Agreement:
    """How a pose fits: shares of the drawn pixels that agree and that are seen through, and how many have depth."""

    agreeing: float
    beyond: float
    pixels: int

    @property
    def fit(self) -> float:
        """To order ends by: from -1 to 1."""
        return self.agreeing - self.beyond


@dataclass(eq=False)
class DepthViews:
    """N depth pictures of the robot.

    Attributes:
        robot: the recording's.
        meshes: by level.
        K: (3, 3) px of the full size.
        depths: N of (H, W) m, 0 where unknown.
        valid: (H, W) where the canvas lies inside the pictures.
        parent_T_link: (N, L, 4, 4) m.
        settings: the numbers.
        notes: what was left out.
        renders: pictures drawn so far.
    """

    robot: PosedRobot
    meshes: dict[int, RenderMesh]
    K: Array
    depths: list[Depth]
    valid: NDArray[np.bool_]
    parent_T_link: Array
    settings: DepthSettings
    notes: tuple[str, ...] = ()
    renders: int = 0
    _renderers: dict[int, list[Renderer]] = field(default_factory=dict)

    @staticmethod
    def of(recording: Recording, settings: DepthSettings) -> DepthViews:
        """Read and undistort them; a depth picture that cannot be read costs its sample.

        Raises:
            Refusal: no intrinsics, robot, joints or depth, or none that can be read.
        """
        import cv2

        try:
            robot = photographed_robot(recording)
        except InputError as error:
            raise Refusal(str(error)) from error
        lens = Rectification.of(recording.present.camera)
        rows, depths, notes = [], [], []
        for row in robot.samples.tolist():
            if recording.depths is None or recording.depths[row] is None:
                continue
            try:
                depth = recording.depth(row)
            except InputError as error:
                notes.append(str(error))
                continue
            flat = cv2.remap(
                depth, *lens.maps, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT, borderValue=0
            )
            rows.append(row)
            depths.append(np.ascontiguousarray(flat[:: lens.shrink, :: lens.shrink], np.float32))
        if not rows:
            raise Refusal(notes[0] if notes else "no sample with joints has depth: give samples[].depth")
        K = lens.K.copy()
        if lens.shrink > 1:  # every n-th pixel, not the mean of n, which would mix depths
            K[:2, 2] -= (1 - 1 / lens.shrink) / 2
        return DepthViews(
            robot,
            meshes_by_level(robot.model),
            K,
            depths,
            lens.valid,
            robot.link_poses(robot.joints_rad[rows]),
            settings,
            tuple(notes),
        )

    def __len__(self) -> int:
        return len(self.depths)

    def moved(self, level: int) -> NDArray[np.float32]:
        """(N, H, W) 1 where something is nearer than the background that a fixed camera sees, 0 elsewhere."""
        depths = np.stack([depth[::level, ::level] for depth in self.depths])
        known = (depths > 0).sum(0)
        ordered = np.sort(np.where(depths > 0, depths, np.inf), axis=0)
        place = np.floor(_BACKGROUND * np.maximum(known - 1, 0)).astype(int)
        background = np.take_along_axis(ordered, place[None], axis=0)[0]
        background[known == 0] = 0.0
        limit = background - np.maximum(self.settings.moved_m, 5 * self.settings.noise_per_m * background**2)
        return np.asarray((depths > 0) & (depths < limit), np.float32)

    def explained(self, camera_T_parent: Array, moved: NDArray[np.float32], level: int) -> float:
        """Share of the pixels `moved` of this size that lie on the drawn robot; 1 when nothing moved."""

        def one(view: int, renderer: Renderer) -> tuple[float, float]:
            there = moved[view] > 0
            return float((there & (renderer.face >= 0)).sum()), float(there.sum())

        on_robot, every = np.sum(self._each(camera_T_parent, level, one), 0)
        return float(on_robot / every) if every else 1.0

    def normal_equations(
        self, camera_T_parent: Array, stage: Stage, noise: float
    ) -> tuple[Array, Array, int]:
        """Information (6, 6), gradient (6,) and the pixels used, of all views at one size."""
        level, settings = stage.level, self.settings
        intrinsics = np.array([self.K[0, 0], self.K[1, 1], self.K[0, 2], self.K[1, 2]]) / level
        mesh = mesh_at(self.meshes, level)
        face_link = mesh.part_link[mesh.face_part]

        def one(view: int, renderer: Renderer) -> tuple[Array, Array, int]:
            A, b = np.zeros((6, 6)), np.zeros(6)
            camera_T_link = camera_T_parent @ self.parent_T_link[view]
            drawn = kernels.Drawn(
                renderer.face,
                renderer.nearness,
                renderer.box,
                mesh.planes,
                face_link,
                np.ascontiguousarray(camera_T_link[:, :3, :3], np.float32),
            )
            depth, limits = (
                self._depth(view, level),
                (stage.limit_m, noise, settings.floor_m, settings.grazing),
            )
            return A, b, kernels.add_pixels(drawn, depth, intrinsics, *limits, A, b)

        found = self._each(camera_T_parent, level, one)
        A, b, counts = (np.array(column) for column in zip(*found, strict=True))
        one_of = settings.correlated_pixels
        return A.sum(0) / one_of, b.sum(0) / one_of, int(counts.sum())

    def agreement(self, camera_T_parent: Array, level: int, noise: float) -> Agreement:
        """How the drawn robot fits the depth pictures."""

        def one(view: int, renderer: Renderer) -> Array:
            counts = np.zeros(4)
            kernels.compare(
                renderer.face,
                renderer.nearness,
                renderer.box,
                self._depth(view, level),
                noise,
                self.settings.agreeing_m,
                self.settings.beyond_m,
                counts,
            )
            return counts

        found = self._each(camera_T_parent, level, one)
        agreeing, before, beyond, pixels = np.sum(found, 0).tolist()
        judged = max(pixels - before, 1.0)
        return Agreement(agreeing / judged, beyond / judged, int(pixels))

    def costs(self, camera_T_parent: Array, views: Iterable[int], level: int) -> tuple[Array, Array]:
        """Mean offset of depth from the drawn robot in some views, m, for each of P poses, and pixels compared.

        Args:
            camera_T_parent: (P, 4, 4).

        Returns:
            (P,) m, infinite where the robot is nowhere drawn on measured depth, and (P,).
        """
        chosen, renderers = list(views), self._drawers(level)
        found = np.zeros((len(camera_T_parent), 2))
        self.renders += len(chosen) * len(found)
        limits = self.settings.noise_per_m, self.settings.agreeing_m, self.settings.beyond_m

        def share(number: int) -> None:
            renderer, counts = renderers[number], np.zeros(4)
            for index in range(number, len(found), len(renderers)):
                counts[:] = 0
                for view in chosen:
                    renderer.rasterise(camera_T_parent[index] @ self.parent_T_link[view])
                    drawn = renderer.face, renderer.nearness, renderer.box
                    found[index, 0] += kernels.compare(*drawn, self._depth(view, level), *limits, counts)
                found[index, 1] = counts[3]

        threads.each(share, range(len(renderers)))
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(found[:, 1] > 0, found[:, 0] / found[:, 1], np.inf), found[:, 1]

    def noise(self, camera_T_parent: Array, limit_m: float) -> float:
        """The noise of depth over the square of the distance, 1/m, by the median offset from the drawn robot."""

        def one(view: int, renderer: Renderer) -> float:
            depth = self._depth(view, 2)
            found = np.empty(depth.size, np.float32)
            drawn = renderer.face, renderer.nearness, renderer.box
            count = kernels.relative_offsets(*drawn, depth, limit_m, found)
            return float(np.median(found[:count])) if count else np.nan

        offsets = self._each(camera_T_parent, 2, one)
        return float(1.4826 * np.nanmedian(offsets)) if np.isfinite(offsets).any() else np.nan

    def _each(
        self, camera_T_parent: Array, level: int, work: Callable[[int, Renderer], Result]
    ) -> list[Result]:
        """`work(view, renderer)` with the robot drawn, for every view, in threads."""
        renderers = self._drawers(level)
        self.renders += len(self)

        def share(number: int) -> list[tuple[int, Result]]:
            done = []
            for view in range(number, len(self), len(renderers)):
                renderers[number].rasterise(camera_T_parent @ self.parent_T_link[view])
                done.append((view, work(view, renderers[number])))
            return done

        rows = [row for rows in threads.each(share, range(len(renderers))) for row in rows]
        return [result for _, result in sorted(rows, key=lambda row: row[0])]

    def _drawers(self, level: int) -> list[Renderer]:
        if level not in self._renderers:
            height, width = self._depth(0, level).shape
            K = self.K.copy()
            K[:2] /= level
            mesh = mesh_at(self.meshes, level)
            count = min(threads.count(), len(self))
            self._renderers[level] = [Renderer(mesh, K, width, height) for _ in range(count)]
        return self._renderers[level]

    def _depth(self, view: int, level: int) -> Depth:
        return self.depths[view][::level, ::level]
