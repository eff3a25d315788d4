"""Second-order alignment of a rendered robot with pictures of it: Gauss-Newton on silhouette, colours and edges.

Coarse to fine on one CPU core: translation from centroid and area of the mask; the drawn contour against the
signed distance of the mask's contour; the anti-aliased picture of flat parts, one colour per part estimated
within the loop. Where parts are lit or the background is not uniform, and where the colours contradict an exact mask,
the mask takes the place of the colours: its coverage, then the intervals between pixel centres through which its
contour must pass.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hecbench import se3
from hecbench.errors import Refusal, SolverFailure
from hecbench.estimate import Estimate, Termination
from hecbench.recording import CameraModel, Recording
from hecbench.robots.posed import PosedRobot
from hecbench.se3 import Array
from hecbench_plugins.second_order import evidence
from hecbench_plugins.second_order.descent import Trace, descend, draw_counted
from hecbench_plugins.second_order.flatness import unevenness
from hecbench_plugins.second_order.mask_intervals import between_pixels, violated_share
from hecbench_plugins.second_order.photometry import Photometry, tone_exponent
from hecbench_plugins.second_order.settings import STAGES
from hecbench_plugins.second_order.silhouette import centroid_and_area, distances_at, silhouette_step
from hecbench_plugins.second_order.unknowns import ExtendedPhotometry, Unknown, solve
from hecbench_plugins.views.pyramid import RaggedMasks, View, linearised, prepare

_TERMINATIONS = {
    "converged": Termination.CONVERGED,
    "stalled": Termination.STALLED,
    "iterations": Termination.MAX_ITERATIONS,
}


@dataclass(frozen=True)
class RenderGN:
    """The options of the method.

    An answer is believed when drawing and mask overlap by `sure_overlap`, or `good_overlap` when the colours had no
    say or their descent no end. Where less overlaps, either something hides
    part of the robot or the pose is wrong. What hides a part cuts pieces off the mask and leaves the rest of its
    contour in place, a wrong pose draws its contour elsewhere: besides `least_overlap`, a share `least_contour` of
    the drawn contour must then lie within 2 px of the mask's, and without colours all but `most_violated` of it
    between the pixel centres where the mask changes; or the run is a failure.

    Attributes:
        unknown: solved for besides the camera, each with a prior: joint offsets, scale of the robot, focal length.
        huber: residual in [0, 1] from which on a pixel's colour counts less.
        good_overlap: intersection over union of mask and drawing below which other starts are tried.
        sure_overlap, least_overlap, least_contour: see above.
        most_violated: share of the contour beside the mask's changes above which the mask is not one of sampled
            pixels and the coverage alone decides.
        most_more_violated: share of the contour by which the colours' end may violate more of such a mask than the
            mask's own end does, which is about twice the contour's shift in px. Pixels on the edge differ by 0.02.
    """

    unknown: tuple[Unknown, ...] = ()
    huber: float = 0.3
    good_overlap: float = 0.9
    sure_overlap: float = 0.8
    least_overlap: float = 0.6
    least_contour: float = 2 / 3
    most_violated: float = 0.25
    most_more_violated: float = 0.02

    def __call__(self, recording: Recording, *, rng: np.random.Generator) -> Estimate:
        """Calibrate from the recording's start, by given masks or those that a uniform background gives."""
        if recording.initial_parent_T_camera is None:
            raise Refusal("render_gn needs a start: initial_parent_T_camera, or --init FILE")
        robot, views = prepare(recording)
        robot.check_start(recording)
        start = se3.inverse(recording.initial_parent_T_camera)
        trace = Trace()
        if any(self._camera_inside(view, start, trace) for view in views):
            raise Refusal("at the start the camera is inside the robot: check its units and direction")
        coarse = self._align(views, start, trace)
        end = self._refine(views, coarse, trace)
        overlap = evidence.overlap(views, end.descent.pose, trace)
        self._believe(views, end, overlap, trace)
        if self.unknown:
            end = self._extend(end, robot, trace)
        found = evidence.to_estimate(views, end, overlap, trace, _TERMINATIONS[end.descent.ended])
        return (
            replace(found, camera=_calibrated(recording.present.camera, found))
            if "focal" in found.extras
            else found
        )

    def _extend(self, end: evidence.FinalStage, robot: PosedRobot, trace: Trace) -> evidence.FinalStage:
        """Solve for the other unknowns too, from where the camera alone ended."""
        last = end.photometry
        last(end.descent.pose)
        wider = ExtendedPhotometry(
            last.views,
            last.level,
            last.channels,
            last.huber,
            trace,
            blur_px=last.blur_px,
            robot=robot,
            free=tuple(Unknown(unknown) for unknown in self.unknown),
        )
        solved = solve(wider, end.descent.pose, last.noise())
        return evidence.FinalStage(end.kind, solved.descent, wider, solved.extras, solved.covariance)

    def _believe(self, views: list[View], end: evidence.FinalStage, overlap: float, trace: Trace) -> None:
        """Raises SolverFailure when the mask contradicts the end; see the class."""
        colours = end.kind == "colour" and end.descent.ended != "iterations"
        if overlap >= (self.sure_overlap if colours else self.good_overlap):
            return
        found = evidence.contour_found(views, end.descent.pose, trace)
        settled = colours or end.kind == "intervals"
        if settled and overlap >= self.least_overlap and found >= self.least_contour:
            return
        reason = (
            f"ended where drawing and mask overlap by {overlap:.2f} only and share {100 * found:.0f} % of the"
            " contour: the start is too far off, or the masks show another robot or too little of it"
        )
        if end.kind == "coverage" and overlap >= self.least_overlap:
            raise RaggedMasks(reason, se3.inverse(end.descent.pose))
        raise SolverFailure(reason)

    def _camera_inside(self, view: View, pose: Array, trace: Trace) -> bool:
        renderer = draw_counted(view, 4, pose, trace).renderer
        covered = (renderer.face >= 0).mean()
        return renderer.dropped > 0 and covered > 0.9

    def _align(self, views: list[View], start: Array, trace: Trace) -> Array:
        """The best of silhouette alignments from turned starts; the first good one ends the search."""
        best, best_overlap = start, -1.0
        for turn in STAGES.restart_turns_deg:
            pose = start.copy()
            pose[:3, :3] = se3.so3_exp(np.deg2rad(turn)) @ start[:3, :3]
            pose = centroid_and_area(views, pose, trace)
            for level, clip, rounds in STAGES.silhouette:
                step = silhouette_step(views, level, distances_at(views, level), clip, trace)
                pose = descend(step, pose, rounds, trace, f"silhouette/{level}", small=1e-4).pose
            overlap = evidence.overlap(views, pose, trace)
            if overlap > best_overlap:
                best, best_overlap = pose, overlap
            if overlap > self.good_overlap:
                break
        return best

    def _refine(self, views: list[View], pose: Array, trace: Trace) -> evidence.FinalStage:
        """Photometry where flat colours explain the pictures and contradict no given mask, else the masks.

        A given mask is evidence: where the mask's own end shows it to be one of sampled pixels, the colours must
        leave its contour where it is.
        """
        if not all(view.has_image and view.uniform_background for view in views):
            return self._by_masks(views, pose, trace)
        colour = self._by_colours(views, pose, trace)
        colour.photometry(colour.descent.pose)
        flat = unevenness(colour.photometry) <= STAGES.most_uneven
        if not any(view.has_mask for view in views):
            if flat:
                return colour
            raise SolverFailure("the parts of the robot are lit, or the background is uneven: give masks")
        masks = self._by_masks(views, pose, trace)
        if masks.kind != "intervals":
            return colour if flat else masks
        more = violated_share(views, colour.descent.pose, trace) - violated_share(
            views, masks.descent.pose, trace
        )
        if more > self.most_more_violated:
            return masks
        return replace(colour, rivals=(*masks.rivals, masks.descent.pose))

    def _by_colours(self, views: list[View], pose: Array, trace: Trace) -> evidence.FinalStage:
        """One flat colour per part, coarse to fine, then the pictures' tone curve and blur."""
        for level, rounds in STAGES.colour:
            photometry = Photometry(views, level, slice(0, 3), self.huber, trace)
            descent = descend(photometry, pose, rounds, trace, f"colour/{level}")
            pose = descent.pose
        exponent = tone_exponent(photometry)
        if exponent != 1.0:
            views = [linearised(view, exponent) for view in views]
            photometry = Photometry(views, 1, slice(0, 3), self.huber, trace)
            descent = descend(photometry, pose, STAGES.most_rounds, trace, f"tone {exponent:.2f}/1")
            pose = descent.pose
        for blur in STAGES.blurs_px:
            blurred = Photometry(views, 1, slice(0, 3), self.huber, trace, blur_px=blur)
            if blurred(pose)[0] > descent.cost:
                break
            descent = descend(blurred, pose, STAGES.most_rounds, trace, f"blur {blur}/1")
            pose, photometry = descent.pose, blurred
        return evidence.FinalStage("colour", descent, photometry)

    def _by_masks(self, views: list[View], pose: Array, trace: Trace) -> evidence.FinalStage:
        """Coverage, then the intervals between pixel centres unless the mask is not one of sampled pixels."""
        coverage = Photometry(views, 1, slice(3, 4), self.huber, trace)
        descent = descend(coverage, pose, STAGES.most_rounds, trace, "coverage/1")
        pose, violated = between_pixels(views, coverage, descent.pose, trace)
        if violated > self.most_violated:
            return evidence.FinalStage("coverage", descent, coverage)
        return evidence.FinalStage(
            "intervals", replace(descent, pose=np.asarray(pose)), coverage, rivals=(descent.pose,)
        )


def _calibrated(camera: CameraModel, found: Estimate) -> CameraModel:
    """The recording's camera with the focal length that was found."""
    K = camera.intrinsics.copy()
    K[:2, :2] *= np.exp(found.extras["focal"]["value"])
    return replace(camera, K=K)
