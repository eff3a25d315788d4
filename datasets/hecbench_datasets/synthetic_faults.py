"""Good generated recordings with one fault seeded into each, to see whether `check` names it.

A fault is a function (recording, rng) -> recording. Faults that need joints take recordings of `arm_recording`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hecbench import se3
from hecbench.recording import CameraModel, Mounting, Recording, RobotDescription
from hecbench.robots.model import RobotModel
from hecbench.se3 import Array
from hecbench.targets import AprilTagTarget, ChessboardTarget, Target

_TARGET = AprilTagTarget("tag36h11", 0, 0.12)
_HOME_RAD = np.deg2rad([0.0, -90.0, 90.0, -90.0, -90.0, 0.0])
_JOINT_SPREAD_RAD = np.deg2rad([15.0, 15.0, 20.0, 25.0, 25.0, 40.0])
_DISTANCE_M = 2.0
_FOCAL_PX, _WIDTH, _HEIGHT = 2464.0, 2448, 2048
_PIXEL_NOISE_PX = 0.3
_SAMPLE_INTERVAL_S = 5.0
_STAMP_JITTER_S = 0.005
_FLIPPED_SHARE = 0.3

Seed = Callable[[Recording, np.random.Generator], Recording]


def arm_recording(robot: RobotModel, rng: np.random.Generator, samples: int = 12) -> Recording:
    """A UR arm that carries a tag before a fixed camera, with joints, stamps, corners and the usual noise."""
    from scipy.spatial.transform import Rotation

    joints_rad = _HOME_RAD + rng.uniform(-1.0, 1.0, (samples, 6)) * _JOINT_SPREAD_RAD
    base_T_flange = robot.forward(joints_rad, base="base", tip="tool0")
    carrier_T_target = se3.make(Rotation.random(random_state=rng).as_matrix(), [0.0, 0.0, 0.05])
    base_T_target = base_T_flange @ carrier_T_target
    facing = base_T_target[0, :3, :3] @ se3.so3_exp(rng.uniform(-0.3, 0.3, 3))
    base_T_camera = se3.make(facing, base_T_target[:, :3, 3].mean(0) - _DISTANCE_M * facing[:, 2])
    noise = se3.from_rotvec(
        np.deg2rad(rng.normal(0.0, 0.05, (samples, 3))), rng.normal(0.0, 5e-4, (samples, 3))
    )
    stamps_s = _SAMPLE_INTERVAL_S * np.arange(samples) + rng.uniform(0.0, 1.0, samples)
    recording = Recording(
        name="arm",
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=tuple(f"{i:06d}" for i in range(samples)),
        robot=RobotDescription(model=robot.name, base_link="base", flange_link="tool0"),
        camera=CameraModel.centred(_WIDTH, _HEIGHT, _FOCAL_PX),
        target=_TARGET,
        truth_parent_T_camera=base_T_camera,
        base_T_flange=base_T_flange @ noise,
        joints_rad=joints_rad,
        robot_stamp_s=stamps_s,
        camera_stamp_s=stamps_s + 0.1 + rng.normal(0.0, _STAMP_JITTER_S, samples),
    )
    return replace(recording, corners_px=_corners(recording, se3.inverse(base_T_camera) @ base_T_target, rng))


def _corners(recording: Recording, camera_T_target: Array, rng: np.random.Generator) -> Array:
    """(N, P, 2) px with noise; NaN outside the image or behind the camera."""
    present = recording.present
    points = se3.transform_points(camera_T_target, present.target.points_m)
    pixels = points @ present.camera.intrinsics.T
    pixels = pixels[..., :2] / pixels[..., 2:] + rng.normal(0.0, _PIXEL_NOISE_PX, pixels[..., :2].shape)
    size = [present.camera.width, present.camera.height]
    unseen = (points[..., 2] <= 0) | ((pixels < 0) | (pixels > size)).any(-1)
    return np.where(unseen[..., None], np.nan, pixels)


def _poses(recording: Recording) -> Array:
    return recording.present.base_T_flange.copy()


def inverted_poses(recording: Recording, rng: np.random.Generator) -> Recording:
    """flange_T_base where base_T_flange is asked for."""
    return replace(recording, base_T_flange=se3.inverse(_poses(recording)))


def wrong_mounting(recording: Recording, rng: np.random.Generator) -> Recording:
    """The mounting that it is not."""
    eye_to_hand = recording.mounting is Mounting.EYE_TO_HAND
    return replace(recording, mounting=Mounting.EYE_IN_HAND if eye_to_hand else Mounting.EYE_TO_HAND)


def robot_in_millimetres(recording: Recording, rng: np.random.Generator) -> Recording:
    """Positions of the robot in mm."""
    poses = _poses(recording)
    poses[:, :3, 3] *= 1e3
    return replace(recording, base_T_flange=poses)


def target_in_millimetres(recording: Recording, rng: np.random.Generator) -> Recording:
    """The target's size in mm."""
    return replace(recording, target=_resized(recording, 1e3))


def target_size(recording: Recording, rng: np.random.Generator) -> Recording:
    """The target 5 % larger or smaller than declared."""
    return replace(recording, target=_resized(recording, rng.choice([0.95, 1.05])))


def _resized(recording: Recording, factor: float) -> Target:
    match recording.target:
        case AprilTagTarget() as tag:
            return replace(tag, size_m=tag.size_m * factor)
        case ChessboardTarget() as board:
            return replace(board, square_m=board.square_m * factor)
    raise ValueError(f"no size to change in {recording.target}")


def one_axis(recording: Recording, rng: np.random.Generator) -> Recording:
    """All samples turned about one axis."""
    axis = rng.normal(size=3)
    angles = np.deg2rad(rng.uniform(-40.0, 40.0, (len(recording), 1)))
    return _replaced_rotations(recording, angles * axis / np.linalg.norm(axis), rng)


def small_rotation(recording: Recording, rng: np.random.Generator) -> Recording:
    """Rotations within 4 deg of one orientation."""
    turns = rng.normal(size=(len(recording), 3))
    turns *= np.deg2rad(rng.uniform(0.0, 4.0, (len(recording), 1))) / np.linalg.norm(turns, axis=1)[:, None]
    return _replaced_rotations(recording, turns, rng)


def _replaced_rotations(recording: Recording, rotvecs: Array, rng: np.random.Generator) -> Recording:
    """A new rig with the same camera and target, whose target turns by these rotation vectors (N, 3) rad."""
    from scipy.spatial.transform import Rotation

    X, hand_noise = recording.present.truth_parent_T_camera, (len(recording), 3)
    positions = rng.uniform([-0.2, -0.2, 1.8], [0.2, 0.2, 2.2], hand_noise)
    camera_T_target = se3.from_rotvec(rotvecs, positions)
    carrier_T_target = se3.make(Rotation.random(random_state=rng).as_matrix(), [0.0, 0.0, 0.05])
    hand = X @ camera_T_target @ se3.inverse(carrier_T_target)
    noise = se3.from_rotvec(np.deg2rad(rng.normal(0, 0.05, hand_noise)), rng.normal(0, 5e-4, hand_noise))
    poses = hand if recording.mounting is Mounting.EYE_TO_HAND else se3.inverse(hand)
    corners_px = _corners(recording, camera_T_target, rng)
    return replace(recording, base_T_flange=poses @ noise, corners_px=corners_px)


def shifted(recording: Recording, rng: np.random.Generator) -> Recording:
    """Every image with the robot pose of its neighbour."""
    return replace(recording, base_T_flange=np.roll(_poses(recording), rng.choice([-1, 1]), axis=0))


def exchanged(recording: Recording, rng: np.random.Generator) -> Recording:
    """The robot poses of two samples exchanged."""
    poses = _poses(recording)
    a, b = rng.choice(len(poses), 2, replace=False)
    poses[[a, b]] = poses[[b, a]]
    return replace(recording, base_T_flange=poses)


def other_resolution(recording: Recording, rng: np.random.Generator) -> Recording:
    """Intrinsics of images half, two thirds, one and a half times or twice as large."""
    camera = recording.present.camera
    K = camera.intrinsics.copy()
    K[:2] *= rng.choice([0.5, 2 / 3, 1.5, 2.0])
    return replace(recording, camera=replace(camera, K=K))


def outlier_pose(recording: Recording, rng: np.random.Generator) -> Recording:
    """One robot pose off by 20 mm, or by 3 deg."""
    poses, twist = _poses(recording), rng.normal(size=3)
    twist /= np.linalg.norm(twist)
    i = rng.integers(len(poses))
    if rng.random() < 0.5:
        poses[i, :3, 3] += 0.02 * twist
    else:
        poses[i, :3, :3] = poses[i, :3, :3] @ se3.so3_exp(np.deg2rad(3.0) * twist)
    return replace(recording, base_T_flange=poses)


def moving_by_stamps(recording: Recording, rng: np.random.Generator) -> Recording:
    """One robot pose read 0.2 to 0.5 s after its image, on the way to the next sample; the stamps say so."""
    poses, i = _poses(recording), int(rng.integers(len(recording) - 1))
    stamps_s = _SAMPLE_INTERVAL_S * np.arange(len(poses), dtype=float)
    lag_s = rng.uniform(0.2, 0.5)
    poses[i] = _between(poses[i], poses[i + 1], lag_s / _SAMPLE_INTERVAL_S)
    camera_s = stamps_s + rng.normal(0.0, _STAMP_JITTER_S, len(poses))
    stamps_s[i] += lag_s
    return replace(recording, base_T_flange=poses, robot_stamp_s=stamps_s, camera_stamp_s=camera_s)


def moving_by_joints(recording: Recording, rng: np.random.Generator) -> Recording:
    """One robot pose of another moment than its joints; needs joints."""
    poses, i = _poses(recording), int(rng.integers(len(recording) - 1))
    poses[i] = _between(poses[i], poses[i + 1], rng.uniform(0.04, 0.1))
    return replace(recording, base_T_flange=poses)


def _between(first: Array, second: Array, share: float) -> Array:
    return np.asarray(first @ se3.exp(share * se3.log(se3.inverse(first) @ second)))


def mirrored_target_poses(recording: Recording, rng: np.random.Generator) -> Recording:
    """Only target poses, of which some are the mirror image that a planar target allows; needs corners given."""
    from scipy.spatial.transform import Rotation

    poses = recording.present.camera_T_target.copy()
    chosen = rng.choice(len(poses), max(1, round(_FLIPPED_SHARE * len(poses))), replace=False)
    for i in chosen:
        sight = poses[i, :3, 3] / np.linalg.norm(poses[i, :3, 3])
        normal = poses[i, :3, 2]
        mirrored = 2 * (normal @ sight) * sight - normal
        turn, _ = Rotation.align_vectors(mirrored[None], normal[None])
        poses[i, :3, :3] = turn.as_matrix() @ poses[i, :3, :3]
    return replace(recording, camera_T_target=poses, corners_px=None)


def _stamps_in(per_second: float) -> Seed:
    """The stamps of a clock of its own, whole numbers of another unit; needs stamps."""

    def seed(recording: Recording, rng: np.random.Generator) -> Recording:
        start_s = rng.uniform(0.0, 1e4)
        stamps: dict[str, Any] = {
            name: np.round((np.asarray(getattr(recording, name)) + start_s) * per_second)
            for name in ("robot_stamp_s", "camera_stamp_s")
        }
        return replace(recording, **stamps)

    return seed


def camera_link(recording: Recording, rng: np.random.Generator) -> Recording:
    """Only target poses, in a frame with x forward, y left, z up; needs corners given."""
    link_R_optical = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    poses = se3.make(link_R_optical, np.zeros(3)) @ recording.present.camera_T_target
    return replace(recording, camera_T_target=poses, corners_px=None)


@dataclass(frozen=True)
class Fault:
    """What is done to a good recording, what must be named, and what the recording must have for it.

    Where the answer stays right for what the data are, what is named is not `critical`.
    """

    seed: Seed
    finding: str
    needs_joints: bool = False
    needs_target_poses: bool = False
    critical: bool = True


FAULTS: Mapping[str, Fault] = {
    "inverted robot poses": Fault(inverted_poses, "pose_direction_or_mounting"),
    "wrong mounting": Fault(wrong_mounting, "pose_direction_or_mounting"),
    "inverted robot poses, joints": Fault(inverted_poses, "pose_direction_or_mounting", needs_joints=True),
    "wrong mounting, joints": Fault(wrong_mounting, "pose_direction_or_mounting", needs_joints=True),
    "robot in millimetres": Fault(robot_in_millimetres, "units"),
    "target in millimetres": Fault(target_in_millimetres, "units"),
    "one rotation axis": Fault(one_axis, "rotation_diversity"),
    "rotation under 10 deg": Fault(small_rotation, "rotation_diversity"),
    "target size off by 5 %": Fault(target_size, "target_scale"),
    "pairs shifted by one": Fault(shifted, "pairing"),
    "two samples exchanged": Fault(exchanged, "pairing"),
    "moving, by stamps": Fault(moving_by_stamps, "sample_moving"),
    "moving, by joints": Fault(moving_by_joints, "sample_moving", needs_joints=True),
    "intrinsics of another resolution": Fault(other_resolution, "intrinsics"),
    "outlier of 20 mm or 3 deg": Fault(outlier_pose, "outlier_sample"),
    "planar flips": Fault(mirrored_target_poses, "planar_ambiguity", needs_target_poses=True),
    "stamps in ms": Fault(_stamps_in(1e3), "clock_lag", needs_joints=True),
    "stamps in us": Fault(_stamps_in(1e6), "clock_lag", needs_joints=True),
    "frame of the camera's housing": Fault(
        camera_link, "camera_frame", needs_target_poses=True, critical=False
    ),
}
