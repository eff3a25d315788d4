"""Keypoints on the robot: how far from their pixels, and from their places, a calibration puts them.

PCK and its area follow the protocol of the Baxter set (Lu, Richter and Yip 2020, "Robust keypoint detection and pose
estimation of robot manipulators with self-occlusions"): one keypoint, the end-effector. ADD is the mean distance of
keypoints in the camera's frame; its area to 0.1 m is that of Lee et al. 2020, "Camera-to-robot pose estimation from a
single image" (DREAM).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.robots.posed import PosedRobot
from hecbench.se3 import Array
from hecbench.specs import EvaluatorSpec, Need, ResultSection
from hecbench.targets import PointsTarget
from hecbench_plugins.markers.settings import TARGET_POSES
from hecbench_plugins.markers.target_poses import project

THRESHOLDS_PX = (20, 30, 40, 50, 100, 150, 200)
_AREA_PX, _BAXTER_AREA_MM, _DREAM_AREA_MM = 200, 400, 100


def has_keypoints(recording: Recording) -> bool:
    """Whether the target is points on the flange (or the base, eye in hand) that no method can take a pose from.

    Their frame is that link's: carrier_T_target is the identity. Four points or more would be a target to calibrate by.
    """
    target = recording.target
    return (
        isinstance(target, PointsTarget)
        and len(target.points_m) < TARGET_POSES.least_points
        and {Need.CORNERS, Need.INTRINSICS} <= recording.offers()
        and recording.base_T_flange is not None
    )


def pixel_errors(estimate: Estimate, recording: Recording) -> tuple[Array, NDArray[np.intp]]:
    """Distances (K,) px of the keypoints seen, infinite behind the camera, and the sample (K,) of each."""
    camera, corners = estimate.camera or recording.present.camera, recording.present.corners_px
    target = recording.present.target
    camera_T_target = se3.inverse(estimate.pose) @ recording.hand_poses()
    placed = np.asarray(np.isfinite(camera_T_target).all((1, 2)))
    samples, points = np.nonzero(np.isfinite(corners).all(-1) & placed[:, None])
    in_camera = se3.transform_points(camera_T_target, target.points_m)[samples, points]
    in_front = in_camera[:, 2] > 0
    errors = np.full(len(samples), np.inf)
    if in_front.any():
        predicted = project(camera, np.eye(4), in_camera[in_front])
        errors[in_front] = np.linalg.norm(predicted - corners[samples, points][in_front], axis=1)
    return errors, samples


def pck(
    estimate: Estimate,
    recording: Recording,
    *,
    solve: Callable[[Recording], Estimate],
    rng: np.random.Generator,
) -> Mapping[str, Any]:
    """Share of keypoints nearer than each threshold, and the area below that share over 0 to 199 px.

    A keypoint behind the camera is infinitely far, and so is then the mean. `keypoint_poses` counts the different
    robot poses among the samples: pictures of one pose are no independent trials.
    """
    errors, samples = pixel_errors(estimate, recording)
    if not len(errors):
        return {}
    poses = np.unique(recording.present.base_T_flange[np.unique(samples)].round(9), axis=0)
    return {
        "keypoints": len(errors),
        "keypoint_poses": len(poses),
        "keypoint_mean_px": float(errors.mean()),
        "keypoint_median_px": float(np.median(errors)),
        "keypoint_auc": area(errors, _AREA_PX),
        **{f"pck_{threshold}_px": float((errors < threshold).mean()) for threshold in THRESHOLDS_PX},
    }


def area(errors: Array, thresholds: int) -> float:
    """Mean over the thresholds 0, 1, ... of the share of errors below each."""
    return float((errors[:, None] < np.arange(thresholds)).mean())


def add(
    estimate: Estimate,
    recording: Recording,
    *,
    solve: Callable[[Recording], Estimate],
    rng: np.random.Generator,
) -> Mapping[str, float]:
    """Mean distance of the recording's keypoints from where the truth has them, in the camera's frame, and its area."""
    hand = recording.hand_poses()
    known = np.isfinite(hand).all((1, 2))
    points = se3.transform_points(hand[known], recording.present.target.points_m)
    distances_mm = distances_to_truth_mm(estimate, recording, points)
    return {"add_mm": float(distances_mm.mean()), "add_auc_400_mm": area(distances_mm, _BAXTER_AREA_MM)}


def links_add(
    estimate: Estimate,
    recording: Recording,
    *,
    solve: Callable[[Recording], Estimate],
    rng: np.random.Generator,
) -> Mapping[str, float]:
    """The same of the origins of the links: the base, those behind each joint, the flange; area to 0.1 m."""
    robot = PosedRobot.of(recording, meshes=False)
    behind = {joint.child for joint in robot.model.joints if joint.name in robot.joint_names}
    links = sorted({robot.base_link, robot.flange_link, *behind})
    poses = robot.link_poses(robot.joints_rad[robot.samples])
    points = poses[:, [robot.model.link_index(link) for link in links], :3, 3]
    distances_mm = distances_to_truth_mm(estimate, recording, points)
    return {
        "links_add_mm": float(distances_mm.mean()),
        "links_add_auc_100_mm": float(np.maximum(0, 1 - distances_mm / _DREAM_AREA_MM).mean()),
    }


def distances_to_truth_mm(estimate: Estimate, recording: Recording, points: Array) -> Array:
    """For each sample the mean distance (N,) mm, in the camera's frame, of points (N, P, 3) m of the parent's frame."""
    estimated, true = (
        se3.transform_points(se3.inverse(pose), points)
        for pose in (estimate.pose, recording.present.truth_parent_T_camera)
    )
    return np.asarray(1e3 * np.linalg.norm(estimated - true, axis=-1).mean(1))


@hookimpl
def hecbench_evaluators() -> Iterable[EvaluatorSpec]:
    """This file's evaluators."""
    yield EvaluatorSpec(
        name="pck",
        summary="keypoints of the robot predicted in the picture (PCK)",
        factory=lambda: pck,
        into=ResultSection.DIAGNOSTICS,
        applies=has_keypoints,
    )
    yield EvaluatorSpec(
        name="add",
        summary="keypoints of the robot away from where the truth has them (ADD)",
        factory=lambda: add,
        into=ResultSection.ERRORS,
        applies=lambda recording: recording.truth_parent_T_camera is not None and has_keypoints(recording),
    )
    yield EvaluatorSpec(
        name="links_add",
        summary="origins of the robot's links away from where the truth has them (ADD)",
        factory=lambda: links_add,
        into=ResultSection.ERRORS,
        applies=lambda recording: (
            recording.truth_parent_T_camera is not None
            and {Need.JOINTS, Need.ROBOT_MODEL} <= recording.offers()
            and (recording.target is None or has_keypoints(recording))
        ),
    )
