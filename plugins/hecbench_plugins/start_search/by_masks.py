"""A start from nothing but masks: camera poses all over a view sphere, judged by how masks and drawings agree.

After the hemisphere search of EasyHeC++ (Hong et al. 2024) and the swarm of roboreg at a tenth of the image's size,
with two differences: of the six unknowns only direction and roll are tried, distance and place in the image follow
from the mask's area and centroid; and the best are refined by Gauss-Newton before they are compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from hecbench import se3
from hecbench.errors import Refusal, SolverFailure
from hecbench.estimate import Estimate
from hecbench.recording import Mounting, Recording
from hecbench.rendering import Renderer, RenderMesh
from hecbench.rendering.undistort import shrunk_intrinsics
from hecbench.robots.model import RobotModel
from hecbench.se3 import Array
from hecbench_plugins.second_order.descent import Trace, descend
from hecbench_plugins.second_order.render_gn import RenderGN
from hecbench_plugins.second_order.silhouette import silhouette_step
from hecbench_plugins.start_search.kernels import moments, shared_pixels
from hecbench_plugins.start_search.settings import MASKS
from hecbench_plugins.start_search.view_sphere import ViewSphere, alike, best_apart, look_at
from hecbench_plugins.views.pyramid import (
    Level,
    RaggedMasks,
    View,
    meshes_by_level,
    prepare,
    shrink,
    signed_distance,
)

_SIZE = 0
"""The key of the search's size among a view's levels."""


@lru_cache(maxsize=4)
def _search_mesh(model: RobotModel) -> tuple[RenderMesh, float]:
    """A coarse mesh and the robot's extent, m: cells of one pixel where the robot is `MASKS.search_px` large."""
    meshes = meshes_by_level(model)
    joints = np.clip(np.zeros(len(model.joint_names)), *model.limits().T)
    extent_m = float(np.ptp(_vertices(meshes[4], model.link_poses(joints)), axis=0).max())
    return RenderMesh.of(model, cell_m=extent_m / MASKS.search_px), extent_m


def _vertices(mesh: RenderMesh, frame_T_link: Array) -> Array:
    """The vertices (V, 3) m in the frame of the link poses (L, 4, 4)."""
    link = np.repeat(np.arange(len(frame_T_link)), np.diff(mesh.vertex_start))
    turned = np.einsum("vij,jv->vi", frame_T_link[link, :3, :3], mesh.vertices.astype(float))
    return np.asarray(turned + frame_T_link[link, :3, 3])


class MaskScore:
    """How a drawn robot agrees with masks at a small size, in several views of one camera."""

    def __init__(self, views: Sequence[View], mesh: RenderMesh, trace: Trace) -> None:
        self.trace = trace
        self.views = [_small(view, mesh) for view in views]
        observed = [view.levels[_SIZE].observed[..., 3] for view in self.views]
        self._masks = [mask > 0.5 for mask in observed]
        self._areas = [int(mask.sum()) for mask in self._masks]
        self._distances = [signed_distance(mask) for mask in observed]
        self.rays = [
            _ray(view.levels[_SIZE].renderer, *np.argwhere(mask).mean(0)[::-1])
            for view, mask in zip(self.views, self._masks, strict=True)
        ]
        """(x, y, 1) through the masks' centroids."""

    def __call__(self, camera_T_parent: Array) -> float:
        """Mean intersection over union of the drawn robot and the masks."""
        values = []
        for view, mask, area in zip(self.views, self._masks, self._areas, strict=True):
            renderer = self._rasterised(view, camera_T_parent)
            drawn, shared = shared_pixels(renderer.face, mask, renderer.box)
            values.append(shared / (drawn + area - shared))
        return float(np.mean(values))

    def placed(self, camera_T_parent: Array) -> Array:
        """The pose moved until centroid and area of the drawn robot match the masks; its rotation stays."""
        pose = camera_T_parent.copy()
        for _ in range(MASKS.placing_rounds):
            moves = []
            for view, ray, area in zip(self.views, self.rays, self._areas, strict=True):
                renderer = self._rasterised(view, pose)
                drawn, x, y, near = moments(renderer.face, renderer.nearness, renderer.box)
                if drawn >= MASKS.fewest_pixels:
                    ratio = np.clip(np.sqrt(drawn / area), 0.5, 2.0)
                    moves.append((ray * ratio - _ray(renderer, x, y)) / near)
            if not moves:
                break
            pose[:3, 3] += np.mean(moves, 0)
        return pose

    def _rasterised(self, view: View, camera_T_parent: Array) -> Renderer:
        renderer = view.levels[_SIZE].renderer
        renderer.rasterise(camera_T_parent @ view.parent_T_link)
        self.trace.renders += 1
        return renderer

    def refined(self, camera_T_parent: Array, iterations: int) -> Array:
        """Some Gauss-Newton steps of the drawn contour towards the masks' contours."""
        step = silhouette_step(self.views, _SIZE, self._distances, MASKS.clip_px, self.trace)
        return descend(step, camera_T_parent, iterations, self.trace, "search", small=MASKS.small_step).pose


def _small(view: View, mesh: RenderMesh) -> View:
    """The view at the size of the search alone."""
    full = view.levels[1]
    rows, columns = np.nonzero(full.observed[..., 3] > 0.5)
    size = int(np.clip(round(max(np.ptp(rows), np.ptp(columns)) / MASKS.search_px), 1, MASKS.smallest))
    observed = shrink(full.observed, size)
    K = shrunk_intrinsics(np.asarray(full.renderer.K, float), 1 / size)
    renderer = Renderer(mesh, K, observed.shape[1], observed.shape[0])
    return replace(view, levels={_SIZE: Level(renderer, observed, full.background, None)})


def _ray(renderer: Renderer, x: float, y: float) -> Array:
    K = np.asarray(renderer.K, float)
    return np.array([(x - K[0, 2]) / K[0, 0], (y - K[1, 2]) / K[1, 1], 1.0])


@dataclass(frozen=True, eq=False)
class Start:
    """A pose that a search found, and how well it agrees with the masks, in [0, 1]."""

    camera_T_parent: Array
    overlap: float


def starts(model: RobotModel, views: Sequence[View], sphere: ViewSphere, trace: Trace) -> list[Start]:
    """The best distinct poses of a fixed camera by the masks of its views, best first.

    The views with the largest masks are scanned over the sphere, and the best poses refined on more of them.

    Args:
        model: of the robot.
        views: from `render_views.prepare`.
        sphere: the directions and rolls that are tried.
        trace: counts the drawings.
    """
    mesh, extent_m = _search_mesh(model)
    order = np.argsort([-float(view.levels[4].observed[..., 3].sum()) for view in views], kind="stable")
    scan = MaskScore([views[i] for i in order[: MASKS.scanned_views]], mesh, trace)
    root_T_link = se3.inverse(scan.views[0].parent_T_link[0]) @ scan.views[0].parent_T_link
    points_m = _vertices(mesh, root_T_link)
    middle_m = (points_m.min(0) + points_m.max(0)) / 2
    root_T_parent = se3.inverse(scan.views[0].parent_T_link[0])
    looks = look_at(sphere.rotations(), middle_m, scan.rays[0], 2 * extent_m) @ root_T_parent
    poses = [scan.placed(look) for look in looks]
    scores = [scan(pose) for pose in poses]
    fine = MaskScore([views[i] for i in order[: MASKS.refined_views]], mesh, trace)
    for score, (count, iterations) in ((scan, MASKS.first_round), *((fine, later) for later in MASKS.rounds)):
        kept = best_apart(poses, scores, count)
        poses = [score.refined(poses[i], iterations) for i in kept]
        scores = [score(pose) for pose in poses]
    return [Start(poses[i], scores[i]) for i in best_apart(poses, scores, len(poses))]


@dataclass(frozen=True)
class GuessFree:
    """`render_gn` from the best poses of a view sphere instead of a given start.

    A rival is a distinct pose that agrees with the masks nearly as well as the best. Every rival is followed to its
    end too, because the colours may tell what the masks do not; when two ends explain the pictures equally well, the
    recording does not determine the answer.

    Attributes:
        spheres: the cameras that are tried, one sphere after the other.
        sure_overlap: agreement with the masks from which on no further sphere is tried.
        solver: the method that is given the starts.
        least_overlap: agreement with the masks below which no pose on the sphere explains them.
        rival_margin: how much less than the best a rival overlaps at most.
        rival_apart: rotation, rad, and shift, as a share of the distance, from which on a pose is a rival.
        tries: how many starts are followed at most.
        same_overlap, same_noise: two ends are equally good within this difference of overlap and ratio of noise.
    """

    spheres: tuple[ViewSphere, ...] = (ViewSphere(), ViewSphere(spacing_deg=8.0))
    sure_overlap: float = 0.85
    solver: RenderGN = field(default_factory=RenderGN)
    least_overlap: float = 0.5
    rival_margin: float = 0.04
    rival_apart: float = 0.15
    tries: int = 4
    same_overlap: float = 0.02
    same_noise: float = 1.2

    def __call__(self, recording: Recording, *, rng: np.random.Generator) -> Estimate:
        """Calibrate by masks without a start; one that the recording has is not used."""
        if recording.mounting is not Mounting.EYE_TO_HAND:
            raise Refusal(
                "a start is searched for fixed cameras only: give initial_parent_T_camera, or --init FILE"
            )
        robot, views = prepare(recording)
        trace = Trace()
        found = self._found(robot.model, views, trace)
        if found[0].overlap < self.least_overlap:
            raise SolverFailure(
                f"no camera on the view sphere explains the masks: the best overlaps by {found[0].overlap:.2f}"
            )
        ends = self._ends(recording, self._rivals(found), rng)
        best = min(ends, key=lambda end: end.diagnostics["noise"])
        for other in ends:
            if self._contradicts(other, best):
                raise Refusal(
                    f"two cameras explain the masks equally well: {_describe(best)} and {_describe(other)};"
                    " add views with other joints, or give a start"
                )
        searched = {"search_overlap": found[0].overlap, "search_starts": len(ends)}
        return replace(
            best,
            renders=best.renders + trace.renders,
            iterations=best.iterations + trace.iterations,
            diagnostics={**best.diagnostics, **searched},
        )

    def _found(self, model: RobotModel, views: Sequence[View], trace: Trace) -> list[Start]:
        """The starts of the sphere that explains the masks best; the first good one ends the search."""
        best: list[Start] = []
        for sphere in self.spheres:
            found = starts(model, views, sphere, trace)
            if not best or found[0].overlap > best[0].overlap:
                best = found
            if best[0].overlap >= self.sure_overlap:
                break
        return best

    def _rivals(self, found: Sequence[Start]) -> list[Start]:
        near = [start for start in found if start.overlap >= found[0].overlap - self.rival_margin]
        poses, scores = [start.camera_T_parent for start in near], [start.overlap for start in near]
        return [near[i] for i in best_apart(poses, scores, self.tries, self.rival_apart)]

    def _ends(
        self, recording: Recording, rivals: Sequence[Start], rng: np.random.Generator
    ) -> list[Estimate]:
        """Where the solver ends from each start; raises the first failure when none ends well."""
        ends, failures = [], []
        for start in rivals:
            given = replace(recording, initial_parent_T_camera=se3.inverse(start.camera_T_parent))
            try:
                ends.append(self.solver(given, rng=rng))
            except SolverFailure as failure:
                failures.append(failure)
        if not ends and isinstance(failures[0], RaggedMasks):
            raise failures[0]
        if not ends:
            raise SolverFailure(f"from the best start of the search, {failures[0]}")
        return ends

    def _contradicts(self, other: Estimate, best: Estimate) -> bool:
        """Whether another end is as good as the best, and not the same."""
        if alike(se3.inverse(other.pose), se3.inverse(best.pose)):
            return False
        return bool(
            other.diagnostics["overlap"] >= best.diagnostics["overlap"] - self.same_overlap
            and other.diagnostics["noise"] <= self.same_noise * best.diagnostics["noise"]
        )


def _describe(end: Estimate) -> str:
    place = ", ".join(f"{x:.2f}" for x in end.pose[:3, 3])
    return f"at ({place}) m with overlap {end.diagnostics['overlap']:.3f}"
