"""Calibration from raw photographs: search within the start's uncertainty, refine, verify, and only then believe."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import InputError, Refusal, SolverFailure
from hecbench.estimate import Estimate
from hecbench.recording import Mounting, Recording
from hecbench.rendering import RenderMesh
from hecbench.robots.posed import PosedRobot
from hecbench.samples.spread import evenly
from hecbench.se3 import Array
from hecbench_plugins.maskless import evidence
from hecbench_plugins.maskless.ball import Ball
from hecbench_plugins.maskless.contour import Background, ContourEquations, ContourMatcher
from hecbench_plugins.maskless.offsets import compare, prior_information, with_joint_offsets
from hecbench_plugins.maskless.refinement import Refined, RefinementLevel, refine, refine_further, schedule
from hecbench_plugins.maskless.search import Score, search
from hecbench_plugins.maskless.settings import CONTOUR, COURSE, LATTICE_SEARCH, SEARCH, SearchSettings
from hecbench_plugins.second_order.unknowns import Unknown
from hecbench_plugins.start_search.by_photographs import starts
from hecbench_plugins.start_search.settings import PHOTOGRAPHS
from hecbench_plugins.start_search.view_sphere import ViewSphere
from hecbench_plugins.views import scene_background
from hecbench_plugins.views.canvas import Canvas, undistorted_canvas
from hecbench_plugins.views.common_error import common_error
from hecbench_plugins.views.pyramid import mesh_at, meshes_by_level, photographed_robot


@dataclass(frozen=True, eq=False)
class SearchRegion:
    """Where to search: about which parent_T_camera (4, 4), how far, with how many descents and how thoroughly."""

    start: Array
    ball: Ball
    restarts: int
    settings: SearchSettings = SEARCH

    def __str__(self) -> str:
        return f"{self.ball} from {np.array2string(self.start[:3, 3], precision=2, separator=', ')} m"


@dataclass(frozen=True, eq=False)
class Candidate:
    """Where a descent ended, and the share of its contour that the images confirm."""

    camera_T_parent: Array
    confirmed_share: float
    place: SearchRegion
    path: tuple[tuple[str, Array], ...]
    """Stage and camera_T_parent on the way there."""


@dataclass(eq=False)
class Photographs:
    """All photographs of a recording, the few that are searched, and what is known of their background."""

    robot: PosedRobot
    meshes: dict[int, RenderMesh]
    canvas: Canvas
    search_views: Canvas
    background: Background | None
    renders: int = 0
    descents: int = 0
    _searched: dict[RefinementLevel, ContourMatcher] = field(default_factory=dict)

    @staticmethod
    def of(recording: Recording) -> Photographs:
        """Read and undistort them.

        Raises:
            Refusal: no intrinsics, robot, joints or images; joints outside the limits.
        """
        try:
            robot = photographed_robot(recording)
            canvas = undistorted_canvas(recording, robot)
        except InputError as error:
            raise Refusal(str(error)) from error
        search_views = canvas.subset(evenly(len(canvas), COURSE.search_views))
        fixed = recording.mounting is Mounting.EYE_TO_HAND and len(canvas) >= scene_background.FEWEST_VIEWS
        background = Background.of(canvas.images) if fixed else None
        return Photographs(robot, meshes_by_level(robot.model), canvas, search_views, background)

    def foreground(self) -> NDArray[np.float32] | None:
        """How unlike the background each pixel of the searched views is (n, H, W), None where that is not known."""
        if self.background is None:
            return None
        return scene_background.foreground(self.search_views.images, self.background.image.astype(np.float32))

    def lines(self, step: RefinementLevel, canvas: Canvas) -> ContourMatcher:
        """The views of a canvas at the size of a step."""
        background = self.background if step.background else None
        return ContourMatcher(mesh_at(self.meshes, step.level), canvas, step.level, background)

    def refined(self, camera_T_parent: Array) -> Refined:
        """All steps but the last from a pose of the search, on the searched views."""
        pose, found = camera_T_parent, None
        for step in schedule(self.canvas.valid.shape[1])[0]:
            lines = self._searched.get(step) or self._searched.setdefault(
                step, self.lines(step, self.search_views)
            )
            before = lines.renders
            found = refine(lines, pose, step)
            pose = found.camera_T_parent
            self.renders += lines.renders - before
        assert found is not None
        return found

    def refined_on_few(self, camera_T_parent: Array, last: RefinementLevel) -> Array:
        """The last step on the searched views, roughly, where they are fewer than all; the smaller sizes are freed."""
        self._searched.clear()
        if len(self.search_views) == len(self.canvas):
            return camera_T_parent
        lines = self.lines(last, self.search_views)
        found = refine(lines, camera_T_parent, last, COURSE.roughly)
        self.renders += lines.renders
        return found.camera_T_parent


@dataclass(frozen=True)
class Maskless:
    """The options of the method.

    Attributes:
        unknown: solve for constant joint offsets too; nothing else can be.
        restarts: descents of the search in a ball, from one set of draws, before it is given up.
        attempts: sets of draws, each with colours clustered anew.
        least_confirmed_share: share of contour points that the images must confirm for an end to be believed.
        free: the cameras that are tried when no start is to be used.
    """

    unknown: tuple[Unknown, ...] = ()
    restarts: int = 6
    attempts: int = 2
    least_confirmed_share: float = 0.3
    free: ViewSphere | None = None

    def __call__(self, recording: Recording, *, rng: np.random.Generator) -> Estimate:
        """Calibrate from the photographs alone, about the recording's start unless the search is free."""
        start = recording.initial_parent_T_camera
        if start is None and self.free is None:
            raise Refusal("a start is needed: initial_parent_T_camera, or --init FILE")
        if set(self.unknown) - {Unknown.JOINTS}:
            raise Refusal("without masks only joint offsets can be solved for besides the camera: give masks")
        photographs = Photographs.of(recording)
        if self.free is None:
            photographs.robot.check_start(recording)
        if self.free is not None and photographs.background is None:
            raise Refusal(
                f"without masks a start is found for a fixed camera in {scene_background.FEWEST_VIEWS} photographs or"
                " more only: give initial_parent_T_camera, --init FILE, or masks"
            )
        found = self._find(photographs, start, rng)
        if found.confirmed_share < self.least_confirmed_share:
            raise SolverFailure(
                f"the photographs confirm {100 * found.confirmed_share:.0f} % of the contour where the best of"
                f" {photographs.descents} descents ended, {100 * self.least_confirmed_share:.0f} % are needed: the"
                f" camera is farther off than {found.place}, the joints or the robot are not those of the photographs,"
                " the camera or the scene moved, or too little of the robot is seen; give more views or masks"
            )
        return self._finish(photographs, found)

    def _find(self, photographs: Photographs, start: Array | None, rng: np.random.Generator) -> Candidate:
        """The first end that the images confirm, or the best of all descents."""
        search_views, foreground = photographs.search_views, photographs.foreground()
        best: Candidate | None = None
        for place in self._places(photographs, start, foreground):
            score = Score(photographs.meshes[SEARCH.level], search_views, foreground, rng)
            for coarse, _ in search(score, place.start, place.ball, place.restarts, rng, place.settings):
                photographs.descents += 1
                end = photographs.refined(se3.inverse(coarse))
                away = place.ball.away(place.start, se3.inverse(end.camera_T_parent))
                sharp = end.last.confirmed_share if max(away) < COURSE.outside else 0.0
                if best is None or sharp > best.confirmed_share:
                    path = (("start", se3.inverse(place.start)), ("search", se3.inverse(coarse)))
                    best = Candidate(end.camera_T_parent, sharp, place, path)
                if sharp >= self.least_confirmed_share:
                    break
            photographs.renders += score.evaluations * len(search_views)
            if best is not None and best.confirmed_share >= self.least_confirmed_share:
                break
        assert best is not None
        return best

    def _places(
        self, photographs: Photographs, start: Array | None, foreground: NDArray[np.float32] | None
    ) -> list[SearchRegion]:
        """Where to search, in this order."""
        if self.free is not None and foreground is not None:
            model, mesh = photographs.robot.model, photographs.meshes[SEARCH.level]
            coarse = RenderMesh.cached(model, cell_m=PHOTOGRAPHS.coarse_cell_m)
            seen = photographs.search_views
            found = starts(
                (coarse, mesh),
                seen.K,
                seen.valid,
                seen.parent_T_link,
                foreground,
                self.free,
                COURSE.free_starts,
            )
            return [SearchRegion(se3.inverse(pose), COURSE.free_ball, 1, LATTICE_SEARCH) for pose in found]
        assert start is not None
        balls = (
            (COURSE.far,) if len(photographs.canvas) >= COURSE.fewest_for_far else (COURSE.near, COURSE.far)
        )
        return [SearchRegion(start, ball, self.restarts) for ball in balls for _ in range(self.attempts)]

    def _finish(self, photographs: Photographs, found: Candidate) -> Estimate:
        """The last steps on all photographs, and the evidence."""
        canvas = photographs.canvas
        _, last = schedule(canvas.valid.shape[1])
        path = [*found.path, ("refined", found.camera_T_parent)]
        rough = photographs.refined_on_few(found.camera_T_parent, last)
        lines = photographs.lines(last, canvas)
        end = refine(lines, rough, last, COURSE.roughly)
        rest, left_out_m = _without_tool(lines, end, last.spacing), 0.0
        if rest is not None:
            end, left_out_m = replace(end, last=rest), COURSE.tool_m
        end = refine_further(lines, end, last, left_out_m)
        extras: dict[str, Any] = {}
        robot, nominal = photographs.robot, np.zeros(canvas.joints_rad.shape[1])
        if self.unknown:
            solved = with_joint_offsets(lines, end.camera_T_parent, robot, last, left_out_m)
            end, extras, judged = solved.refined, solved.extras, solved.refined.last
        else:
            judged = compare(lines, end.camera_T_parent, robot, nominal, last, left_out_m)
        shared = common_error(end.camera_T_parent, canvas.parent_T_link, float(canvas.K[0, 0]))
        return evidence.to_estimate(
            end,
            evidence.covariance(end.camera_T_parent, judged, prior_information(len(nominal)), shared),
            canvas.sample_ids,
            path,
            photographs.renders + lines.renders,
            {
                "confirmed": found.confirmed_share,
                "descents": photographs.descents,
                "background_known": photographs.background is not None,
                "searched": str(found.place),
                "left_out_around_flange_m": left_out_m,
            },
            extras,
        )


def _without_tool(lines: ContourMatcher, end: Refined, spacing: float) -> ContourEquations | None:
    """The comparison without the sphere around the flange, if the images confirm much less of the contour there.

    A tool or target is there then, something that the model does not know.
    """
    if lines.canvas.flange is None:
        return None
    whole, rest = end.last, lines(end.camera_T_parent, spacing, radius_m=COURSE.tool_m)
    judged = whole.view_judged.sum() - rest.view_judged.sum()
    confirmed = whole.view_confirmed_share @ whole.view_judged - rest.view_confirmed_share @ rest.view_judged
    carries = (
        judged >= CONTOUR.fewest_points and confirmed < COURSE.tool_share * rest.confirmed_share * judged
    )
    return rest if carries else None
