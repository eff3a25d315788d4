"""The camera's pose straight from each picture by a network, and the median of all views; no start, no masks.

After Valassakis, Dreczkowski and Johns 2021, "Learning eye-in-hand camera calibration from a single image" (CoRL):
their direct regression, here for a standing camera, with the joints as a second input and with all views combined.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hecbench import se3
from hecbench.errors import InputError, Refusal, SolverFailure
from hecbench.estimate import Estimate
from hecbench.recording import Mounting, Recording
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import Need, Option, Solver, SolverSpec
from hecbench_plugins.regression.settings import SHIPPED, Settings


@dataclass(frozen=True)
class Regression:
    """The method."""

    settings: Settings

    def __call__(self, recording: Recording, *, rng: np.random.Generator) -> Estimate:
        """The median of what the network answers to each picture.

        Raises:
            Refusal: the camera is on the flange, the weights are of another robot, or no picture has joints.
            SolverFailure: there are no weights, no picture shows a robot, or the views
                contradict each other.
        """
        from hecbench_plugins.regression.combining import combined

        if recording.mounting is not Mounting.EYE_TO_HAND:
            raise Refusal(
                f"{recording.name}: the camera is on the flange; the network knows standing cameras"
            )
        poses = self._views(recording)
        found = combined(poses)
        if found.spread_rad > self.settings.largest_spread_rad:
            raise SolverFailure(
                f"the {len(poses)} views answer rotations that spread by {np.rad2deg(found.spread_rad):.0f} deg, "
                f"{np.rad2deg(self.settings.largest_spread_rad):.0f} are allowed: no robot in sight, or unlike those"
                " that the network was trained on"
            )
        return Estimate(
            parent_T_camera=found.parent_T_camera,
            covariance=found.covariance,
            diagnostics={
                "views": len(poses),
                "spread_mm": 1e3 * found.spread_m,
                "spread_deg": float(np.rad2deg(found.spread_rad)),
            },
        )

    def _views(self, recording: Recording) -> Array:
        """parent_T_camera (N, 4, 4) by each picture that shows the robot and whose joints are known."""
        from hecbench.robots.posed import PosedRobot
        from hecbench_plugins.perception.choice import robot_of
        from hecbench_plugins.perception.skeleton import keypoint_positions
        from hecbench_plugins.regression.model import model_of

        camera, images = recording.present.camera, recording.images or ()
        try:
            network = model_of(self.settings.model)
        except InputError as error:
            raise SolverFailure(str(error)) from error
        network.card.require(robot_of(recording), recording.name)
        try:
            posed = PosedRobot.of(recording, meshes=False)
            order = [posed.joint_names.index(name) for name in network.card.joints]
            parent_T_links = posed.link_poses(posed.joints_rad[posed.samples])
            reference = posed.model.link_index(network.card.reference)
        except (InputError, ValueError) as error:
            raise Refusal(f"{recording.name}: the robot cannot be posed: {error}") from error
        found, images_seen = [], 0
        for sample, poses in zip(posed.samples.tolist(), parent_T_links, strict=True):
            if images[sample] is None:
                continue
            parent_T_reference = poses[reference]
            points = keypoint_positions(
                posed.model.links, network.card.keypoints, se3.inverse(parent_T_reference) @ poses
            )
            joints = posed.joints_rad[sample, order]
            image = recording.image(sample)
            camera_T_reference, blur = network.camera_T_reference(image, camera, joints, points)
            images_seen += 1
            if blur < self.settings.largest_blur:
                found.append(parent_T_reference @ se3.inverse(camera_T_reference))
        if not images_seen:
            raise Refusal(f"{recording.name}: no image has joints: give samples[].joints_rad")
        if not found:
            raise SolverFailure(f"no robot is seen in any of the {images_seen} images")
        return np.array(found)


def regression(model: Path = SHIPPED) -> Solver:
    """The method as the command line has it."""
    return Regression(Settings(model))


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's method."""
    yield SolverSpec(
        name="regression",
        summary="a network answers the camera's pose from each picture and the joints; the median of all views",
        factory=regression,
        needs=frozenset({Need.IMAGES, Need.JOINTS, Need.ROBOT_MODEL, Need.INTRINSICS}),
        reference="after Valassakis et al. 2021",
        slow=True,
        options=(Option("model", Path, "the folder of a trained network; default: the one that is shipped"),),
    )
