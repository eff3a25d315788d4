"""Recordings with truth, drawn in the lab: tags on the flange, and pictures of the arm with masks."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import CameraModel, Mounting, Recording, RobotDescription
from hecbench.se3 import Array
from hecbench.targets import AprilTagTarget
from hecbench_hardware import tag_edges, tags
from hecbench_hardware.clearance import check_pose
from hecbench_hardware.lab.cells import DISTANCE_M, Station, camera_model, ur5e
from hecbench_hardware.lab.eye import Eye, Sensor
from hecbench_hardware.lab.scene import FlangeTag
from hecbench_hardware.lab.stereo import StereoSensor

_TRIES = 4000
_SENSOR = Sensor(supersample=2, noise=2.0)
_PHOTOGRAPH = Sensor(supersample=2, noise=5.0)
_START_ERROR = np.array([0.05] * 3 + [0.08] * 3)
_VIEW_SPREAD_RAD = np.deg2rad(10.0)
_DEPTH_SPREAD_RAD = np.deg2rad(30.0)
_DEPTH_DISTANCE_M = 1.3
"""Stereo cameras see a robot well up to here."""


@dataclass(frozen=True)
class MarkerSet:
    """How a marker calibration is made.

    Attributes:
        samples: poses of the arm.
        spread_deg: each coordinate of the tag's rotation vector is uniform within this.
        box_m: side of the cube in which the tag's centre lies.
        tag_m: size of the tag.
        sensor: of the camera.
        camera: its optics.
    """

    samples: int = 10
    spread_deg: float = 25.0
    box_m: float = 0.3
    tag_m: float = 0.12
    sensor: Sensor = _SENSOR
    camera: CameraModel = field(default_factory=camera_model)


def marker_recording(
    calibration: int, seed: int = 0, how: MarkerSet | None = None, station: Station | None = None
) -> Recording:
    """The tag on the flange at `how.samples` poses before one camera; the pictures are read at once.

    The recording holds the corners as `tags.locate` refined them, not the pictures.
    """
    how, station = how or MarkerSet(), station or ur5e()
    rng = np.random.default_rng([seed, calibration, 1])
    carried = station.flange_tag(calibration)
    carried = FlangeTag(
        AprilTagTarget(carried.target.family, carried.target.id, how.tag_m), carried.flange_T_tag
    )
    base_T_camera = station.camera_pose(calibration)
    eye = Eye(station.scene(flange_tag=carried), how.camera, how.sensor, whole=False)
    joints, corners = [], []
    try:
        for candidate in tag_joints(station, calibration, carried, how, rng):
            eye.scene.place(candidate)
            base_T_tag = station.arm.forward(candidate) @ carried.flange_T_tag
            corners_m = se3.transform_points(base_T_tag, carried.target.points_m)
            try:
                picture = eye.image(base_T_camera, rng, corners_m)
                seen = tags.locate(picture, how.camera, carried.target)
            except tag_edges.TagRefused:
                continue
            joints.append(candidate)
            corners.append(tag_edges.project(how.camera, seen.camera_T_tag, carried.target.points_m))
            if len(joints) == how.samples:
                break
    finally:
        eye.close()
    if len(joints) < how.samples:
        raise InputError(f"calibration {calibration}: only {len(joints)} of {how.samples} poses show the tag")
    return replace(
        described(
            station, f"lab_{station.name}_{calibration:02d}", np.array(joints), base_T_camera, how.camera
        ),
        target=carried.target,
        corners_px=np.array(corners),
    )


def view_recording(
    calibration: int,
    seed: int = 0,
    station: Station | None = None,
    samples: int = 10,
    *,
    sensor: Sensor = _SENSOR,
    room: int = 0,
) -> Recording:
    """Pictures of the arm around a configuration with masks, truth and a start some centimetres off.

    `room` is the seed of what stands around.
    """
    station, camera = station or ur5e(), camera_model(640, 480, 606.0)
    rng = np.random.default_rng([seed, calibration, 2])
    centre = station.configuration_rad(calibration)
    joints = centre + rng.uniform(-_VIEW_SPREAD_RAD, _VIEW_SPREAD_RAD, (samples, len(centre)))
    base_T_camera = station.camera_pose(calibration)
    recording = described(station, f"lab_views_{calibration:02d}", joints, base_T_camera, camera)
    return with_pictures(
        replace(
            recording, initial_parent_T_camera=se3.exp(rng.uniform(-1, 1, 6) * _START_ERROR) @ base_T_camera
        ),
        station,
        rng,
        sensor,
        room,
    )


def photograph_recording(
    calibration: int, seed: int = 0, station: Station | None = None, samples: int = 10
) -> Recording:
    """The same without masks, noisier, in a room whose clutter and colours are each calibration's own."""
    room = int(np.random.default_rng([seed, calibration, 3]).integers(1, 2**31))
    drawn = view_recording(calibration, seed, station, samples, sensor=_PHOTOGRAPH, room=room)
    return replace(drawn, name=f"lab_photographs_{calibration:02d}", masks=None)


def depth_recording(
    calibration: int, seed: int = 0, station: Station | None = None, samples: int = 9
) -> Recording:
    """Pictures, masks and depth of a stereo camera, nearer than the lab's own, with a start some centimetres off."""
    station, camera = station or ur5e(), camera_model(640, 480, 606.0)
    rng = np.random.default_rng([seed, calibration, 4])
    centre = station.configuration_rad(calibration)
    joints = centre + rng.uniform(-_DEPTH_SPREAD_RAD, _DEPTH_SPREAD_RAD, (samples, len(centre)))
    base_T_camera = _nearer(station, station.camera_pose(calibration))
    recording = described(station, f"lab_depth_{calibration:02d}", joints, base_T_camera, camera)
    start = se3.exp(rng.uniform(-1, 1, 6) * _START_ERROR) @ base_T_camera
    started = replace(recording, initial_parent_T_camera=start)
    return with_pictures(started, station, rng, room=int(rng.integers(1, 2**31)), stereo=StereoSensor())


def cell(station: Station, calibration: int, camera: CameraModel) -> Recording:
    """One calibration's cell as a person would describe it: the tag, first joints, and roughly where the camera is."""
    first = station.configuration_rad(calibration)
    truth = station.camera_pose(calibration)
    start = se3.looking(truth[:3, 3].round(1), station.arm.forward(first)[:3, 3].round(1))
    return replace(
        described(station, f"lab_cell_{calibration:02d}", first[None], truth, camera),
        target=station.flange_tag(calibration).target,
        initial_parent_T_camera=start,
        truth_parent_T_camera=None,
    )


def _nearer(station: Station, base_T_camera: Array) -> Array:
    """The camera moved along its view until it is `_DEPTH_DISTANCE_M` from what it looks at."""
    nearer = base_T_camera.copy()
    nearer[:3, 3] += (DISTANCE_M - _DEPTH_DISTANCE_M) * base_T_camera[:3, 2]
    return nearer


def with_pictures(
    recording: Recording,
    station: Station,
    rng: np.random.Generator,
    sensor: Sensor = _SENSOR,
    room: int = 0,
    stereo: StereoSensor | None = None,
) -> Recording:
    """The recording with a picture and a mask of the arm for each of its samples, seen from its truth; and depth."""
    present = recording.present
    eye = Eye(station.scene(room=room), present.camera, sensor)
    images, masks, depths = [], [], []
    try:
        for joints in present.joints_rad:
            eye.scene.place(joints)
            images.append(eye.image(present.truth_parent_T_camera, rng))
            masks.append(eye.mask(present.truth_parent_T_camera).astype(np.uint8) * np.uint8(255))
            if stereo is not None:
                exact = eye.depth(present.truth_parent_T_camera)
                depths.append(stereo(exact, float(present.camera.intrinsics[0, 0]), rng))
    finally:
        eye.close()
    return replace(recording, images=tuple(images), masks=tuple(masks), depths=tuple(depths) or None)


def described(
    station: Station, name: str, joints: Array, base_T_camera: Array, camera: CameraModel
) -> Recording:
    known = station.model == "ur5e"
    return Recording(
        name=name,
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=tuple(f"{i:06d}" for i in range(len(joints))),
        robot=RobotDescription(
            model=f"ur5e+{station.gripper.name}" if known else station.name,
            base_link=station.base_link,
            flange_link=station.flange_link,
            joint_names=station.joint_names,
        ),
        camera=camera,
        truth_parent_T_camera=base_T_camera,
        base_T_flange=station.arm.forward(joints),
        joints_rad=joints,
    )


def tag_joints(
    station: Station, calibration: int, carried: FlangeTag, how: MarkerSet, rng: np.random.Generator
) -> list[Array]:
    """Joints within the limits that turn and shift the tag around its pose in the configuration."""
    start = station.configuration_rad(calibration)
    base_T_tag = station.arm.forward(start) @ carried.flange_T_tag
    found: list[Array] = []
    for _ in range(_TRIES):
        if len(found) == 4 * how.samples:
            break
        turn = np.deg2rad(rng.uniform(-how.spread_deg, how.spread_deg, 3))
        shift = rng.uniform(-how.box_m / 2, how.box_m / 2, 3)
        wanted = se3.make(base_T_tag[:3, :3] @ se3.so3_exp(turn), base_T_tag[:3, 3] + shift)
        for joints in station.arm.inverse(wanted @ se3.inverse(carried.flange_T_tag), start)[:1]:
            try:
                check_pose(station.arm, joints, station.limits)
            except InputError:
                continue
            found.append(joints)
    return found
