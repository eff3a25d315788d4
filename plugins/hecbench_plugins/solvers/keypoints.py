"""The camera from keypoints of the robot that a network finds in the photographs; no start and no masks are needed.

After Lee et al. 2020, "Camera-to-robot pose estimation from a single image" (DREAM): a network finds points of the
robot, forward kinematics places them, PnP gives the camera. Here with all views at once, for a fixed camera and for
one on the flange, with a covariance, and with a refusal when too little is seen.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hecbench.errors import InputError, Refusal, SolverFailure
from hecbench.estimate import Estimate, Termination
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import Need, Option, Solver, SolverSpec
from hecbench_plugins.perception.options import MODEL_OPTION

if TYPE_CHECKING:
    from hecbench_plugins.perception.keypoint_pose import Sightings

_DESCENTS = 3
"""Fewer than about a start of unknown quality: what many keypoints agree on is near."""


@dataclass(frozen=True)
class Keypoints:
    """The method.

    Attributes:
        model: a perception plugin or the folder of a trained network; None: one that knows the robot.
        refine: whether the drawn robot is aligned with the photographs from there, as `render_gn` does without masks;
            where that ends without an answer, that of the keypoints stays.
        least_trust: of a keypoint's heatmap that must lie at one place.
        limit_px: a keypoint farther than this from where the pose puts it is wrong, in pixels of a 640 px wide picture.
        rounds: of RANSAC.
        fewest: trusted keypoints in all views, below which the method refuses.
        least_kinds: different keypoints among those that agree.
        least_share: of the trusted keypoints that must agree.
        largest_deviation_m: of the camera's position, by the covariance, above which the method fails.
    """

    model: str | None = None
    refine: bool = False
    least_trust: float = 0.2
    limit_px: float = 20.0
    rounds: int = 1000
    fewest: int = 12
    least_kinds: int = 4
    least_share: float = 0.4
    largest_deviation_m: float = 0.1

    def __call__(self, recording: Recording, *, rng: np.random.Generator) -> Estimate:
        """The camera that the keypoints of all views agree on.

        Raises:
            Refusal: no network knows the robot, or too few keypoints are trusted.
            SolverFailure: too few of them agree, or they do not determine the camera.
        """
        from hecbench_plugins.perception.keypoint_pose import (
            REFERENCE_WIDTH_PX,
            consensus,
            independent,
            refined,
        )

        camera = recording.present.camera
        seen, views = self._sightings(recording)
        if len(seen.points) < self.fewest:
            raise Refusal(
                f"{recording.name}: {len(seen.points)} keypoints are trusted in {views} images, {self.fewest} are"
                " needed: give more views, or views that show the whole robot"
            )
        limit = self.limit_px * camera.width / REFERENCE_WIDTH_PX / float(camera.intrinsics[0, 0])
        seen = independent(seen)
        answer = refined(seen, consensus(seen, limit, self.rounds, rng), limit)
        share = float(answer.inliers.mean())
        kinds = len(np.unique(seen.keypoint[answer.inliers]))
        if share < self.least_share or kinds < self.least_kinds:
            raise SolverFailure(
                f"{100 * share:.0f} % of the trusted keypoints, of {kinds} kinds, agree on a camera;"
                f" {100 * self.least_share:.0f} % and {self.least_kinds} kinds are needed: another robot, wrong joints"
                " or intrinsics, or too few views"
            )
        deviation = float(np.sqrt(np.trace(answer.covariance[3:, 3:])))
        if deviation > self.largest_deviation_m:
            raise SolverFailure(
                f"the keypoints that agree leave the camera uncertain by {1e3 * deviation:.0f} mm,"
                f" {1e3 * self.largest_deviation_m:.0f} are allowed: give more views, of other postures"
            )
        found = Estimate(
            parent_T_camera=answer.parent_T_camera,
            covariance=answer.covariance,
            termination=Termination.CONVERGED,
            iterations=self.rounds,
            diagnostics={
                "views": views,
                "trusted_keypoints": len(seen.points),
                "agreeing_share": share,
                "keypoint_kinds": kinds,
                "rms_px": answer.rms * float(camera.intrinsics[0, 0]),
            },
        )
        return _aligned(found, recording, rng) if self.refine else found

    def _sightings(self, recording: Recording) -> tuple[Sightings, int]:
        """Every trusted keypoint of every image that has joints, and how many such images there are."""
        import cv2

        from hecbench.robots.posed import PosedRobot
        from hecbench_plugins.perception.choice import perceiver_for, robot_of
        from hecbench_plugins.perception.keypoint_pose import Sightings

        perceiver, camera = perceiver_for(recording, self.model), recording.present.camera
        try:
            posed = PosedRobot.of(recording, meshes=False)
            parent_T_link = posed.link_poses(posed.joints_rad[posed.samples])
        except InputError as error:
            raise Refusal(str(error)) from error
        images = recording.images or ()
        rows, views = [], 0
        for sample, poses in zip(posed.samples.tolist(), parent_T_link, strict=True):
            if images[sample] is None:
                continue
            views += 1
            sight = perceiver.see(recording.image(sample))
            sure = np.flatnonzero(sight.trust > self.least_trust)
            points = perceiver.keypoint_positions(robot_of(recording), posed.model.links, poses)[sure]
            pixels = sight.keypoints[sure].reshape(-1, 1, 2)
            rays = (
                cv2.undistortPoints(pixels, camera.K, camera.distortion).reshape(-1, 2)
                if len(sure)
                else pixels[:, 0]
            )
            rows.append(Sightings(points, rays, sure, np.full(len(sure), sample), sight.trust[sure]))
        if not rows:
            raise Refusal(
                f"{recording.name}: no keypoint is trusted in {views} images that have joints: another robot?"
            )
        return Sightings._make(np.concatenate(values) for values in zip(*rows, strict=True)), views


def _aligned(found: Estimate, recording: Recording, rng: np.random.Generator) -> Estimate:
    """The answer aligned with the photographs, or as it was, and in `refined` which of the two."""
    from hecbench_plugins.maskless.solver import Maskless
    from hecbench_plugins.perception.choice import robot_of

    robot = recording.present.robot
    if robot.model is not None:
        robot = replace(robot, model=robot_of(recording))
    started = replace(recording, robot=robot, initial_parent_T_camera=found.parent_T_camera)
    try:
        aligned = Maskless(restarts=_DESCENTS, attempts=1)(started, rng=rng)
    except (Refusal, SolverFailure) as reason:
        return replace(found, diagnostics={**found.diagnostics, "refined": f"no: {reason}"})
    return replace(
        aligned, diagnostics={**aligned.diagnostics, **found.diagnostics, "refined": "by the photographs"}
    )


def _yes(text: str) -> bool:
    if text not in ("yes", "no"):
        raise ValueError("yes or no")
    return text == "yes"


def keypoints(model: str | None = None, refine: bool = True) -> Solver:
    """The method as the command line has it."""
    return Keypoints(model, refine)


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's method."""
    yield SolverSpec(
        name="keypoints",
        summary="a network finds points of the robot, PnP over all views finds the camera; no start, no masks",
        factory=keypoints,
        needs=frozenset({Need.IMAGES, Need.JOINTS, Need.ROBOT_MODEL, Need.INTRINSICS}),
        reference="after Lee et al. 2020 (DREAM)",
        slow=True,
        options=(
            MODEL_OPTION,
            Option("refine", _yes, "align with the photographs from there: yes or no"),
        ),
    )
