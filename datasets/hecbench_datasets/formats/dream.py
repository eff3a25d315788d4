"""DREAM's sets in NDDS's layout: a JSON and a picture per frame, `_camera_settings.json` beside them; camera fixed.

`objects[0]` holds the robot: `keypoints` with `location` in the camera's frame (x right, y down, z forward) and
`projected_location` in px. Lengths are centimetres in the synthetic sets and metres in the real ones, told apart by
magnitude. `sim_state.joints` holds the joints. A robot whose kinematics are known (the Panda) is laid onto the
keypoints, and that is the truth; for another it is the object's `location` and `quaternion_xyzw`, whose axes are z
forward, x right and y down of the robot. The synthetic sets move the camera with every frame: name one,
``FOLDER/000012.json``.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import CameraModel, Mounting, Recording, RobotDescription
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import DatasetSpec
from hecbench.targets import PointsTarget
from hecbench_datasets.reading.arms import PANDA, Arm
from hecbench_datasets.reading.rigid import rigid_fit
from hecbench_datasets.reading.robots import NO_START, urdf_beside
from hecbench_datasets.reading.sources import finite, foreign, head, item, json_value, natural

_SETTINGS = "_camera_settings.json"
_FARTHEST_M = 10.0
"""A location beyond is in centimetres: no camera looks at an arm from 10 m."""
_LOOK_FIRST = 8
"""Frames that are read before a set of a hundred thousand is."""
_SAME_CAMERA_M, _SAME_CAMERA_RAD = 0.02, np.deg2rad(1.0)
_OBJECT_R_BASE = np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]], float)
"""From the robot's axes to those that `quaternion_xyzw` turns."""


@dataclass(frozen=True)
class _Frame:
    """What one JSON says; lengths in the file's unit."""

    file: Path
    joints: dict[str, float]
    locations: dict[str, Array]
    pixels: dict[str, Array]
    camera_T_object: Array | None


def _frames(path: Path) -> list[Path]:
    """The JSON files of frames: one that was named, or all of a folder."""
    if path.suffix == ".json" and path.stem.isdigit() and (path.parent / _SETTINGS).is_file():
        return [path]
    if not (path / _SETTINGS).is_file():
        return []
    return sorted((file for file in path.glob("*.json") if file.stem.isdigit()), key=natural)


def sniff(path: Path) -> bool:
    """A folder with camera settings and frames in which keypoints stand, or one such frame."""
    files = _frames(path)
    return bool(files) and '"objects"' in head(files[0], 100_000)


@foreign
def load(path: Path) -> Recording:
    """Read the frames that one camera pose explains."""
    files = _frames(path)
    if not files:
        raise InputError(f"{path}: is no frame with {_SETTINGS} beside it, and no folder of such")
    folder = files[0].parent
    frames = [_frame(file) for file in files[:_LOOK_FIRST]]
    names = tuple(frames[0].joints)
    arm = PANDA if set(PANDA.joint_names) <= set(names) else None
    names = arm.joint_names if arm else names
    metres = _metres_per_unit(frames)
    _truth(path, frames, _joints(path, frames, names), arm, metres)
    frames += [_frame(file) for file in files[_LOOK_FIRST:]]
    joints = _joints(path, frames, names)
    truth, note = _truth(path, frames, joints, arm, metres)
    keypoints = sorted(frames[0].locations)
    base = arm.base_link if arm else keypoints[0]
    flange = arm.flange_link if arm else keypoints[-1]
    camera = _camera(folder / _SETTINGS)
    urdf, notes = urdf_beside(folder, "a Franka Panda" if arm else "this robot")
    seen = arm is not None and any(flange in frame.pixels for frame in frames)
    return Recording(
        name=path.resolve().name if path.is_dir() else f"{folder.resolve().name}_{path.stem}",
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=tuple(frame.file.stem for frame in frames),
        robot=RobotDescription(urdf=urdf, base_link=base, flange_link=flange, joint_names=names),
        camera=camera,
        target=PointsTarget(((0.0, 0.0, 0.0),)) if seen else None,
        corners_px=_corners(frames, flange, camera) if seen else None,
        truth_parent_T_camera=truth,
        base_T_flange=arm.base_T_flange(joints) if arm else None,
        joints_rad=joints,
        images=_images(frames),
        folder=folder,
        notes=(note, *notes, NO_START.format(path)),
    )


def _joints(path: Path, frames: list[_Frame], names: tuple[str, ...]) -> Array:
    rows = [[frame.joints.get(name, np.nan) for name in names] for frame in frames]
    return finite(rows, f"{path}: sim_state.joints")


def _frame(file: Path) -> _Frame:
    content = json_value(file)
    objects = item(content, "objects", file)
    if not objects:
        raise InputError(f"{file}: lists no object; leave the frame out")
    robot = objects[0]
    joints = item(item(content, "sim_state", file), "joints", file)
    keypoints = item(robot, "keypoints", file)
    pose = None
    if "quaternion_xyzw" in robot:
        turn = finite(robot["quaternion_xyzw"], f"{file}: quaternion_xyzw", (4,))
        pose = se3.from_quat_xyzw(turn, finite(item(robot, "location", file), f"{file}: location", (3,)))
    return _Frame(
        file,
        {str(j["name"]).rsplit("/", 1)[-1]: float(j["position"]) for j in joints},
        {k["name"]: finite(k["location"], f"{file}: {k['name']}: location", (3,)) for k in keypoints},
        {
            k["name"]: finite(k["projected_location"], f"{file}: {k['name']}: projected_location", (2,))
            for k in keypoints
        },
        pose,
    )


def _camera(file: Path) -> CameraModel:
    settings = item(json_value(file), "camera_settings", file)[0]
    intrinsic = item(settings, "intrinsic_settings", file)
    fx, fy, cx, cy = finite([item(intrinsic, name, file) for name in ("fx", "fy", "cx", "cy")], f"{file}: fx")
    size = settings.get("captured_image_size") or item(intrinsic, "resolution", file)
    K = np.array([[fx, float(intrinsic.get("s", 0)), cx], [0, fy, cy], [0, 0, 1]])
    return CameraModel(int(item(size, "width", file)), int(item(size, "height", file)), K)


def _metres_per_unit(frames: list[_Frame]) -> float:
    depths = [np.linalg.norm(location) for frame in frames for location in frame.locations.values()]
    if not depths:
        raise InputError(f"{frames[0].file}: names no keypoint")
    return 0.01 if float(np.median(depths)) > _FARTHEST_M else 1.0


def _truth(
    path: Path, frames: list[_Frame], joints: Array, arm: Arm | None, metres: float
) -> tuple[Array | None, str]:
    """base_T_camera, and how it was found."""
    unit = "metres" if metres == 1.0 else "centimetres"
    cure = f"name one frame: {frames[0].file}"
    if arm is not None:
        in_base, in_camera = [], []
        for frame, row in zip(frames, joints, strict=True):
            links = tuple(k for k in frame.locations if k in arm.frame_of or k == arm.flange_link)
            in_base += list(arm.link_origins(row, links))
            in_camera += [metres * frame.locations[link] for link in links]
        if len(in_base) < 3:
            raise InputError(
                f"{path}: three keypoints on links of the Panda are needed, found {len(in_base)}"
            )
        base_T_camera, rms_m = rigid_fit(np.array(in_camera), np.array(in_base))
        if rms_m > _SAME_CAMERA_M:
            raise InputError(
                f"{path}: no single camera pose explains the keypoints (rms {rms_m:.3f} m): the camera moves; {cure}"
            )
        note = f"{path}: {unit}; truth: the arm laid onto {len(in_base)} keypoints, rms {1e3 * rms_m:.1f} mm"
        return base_T_camera, note
    poses = [frame.camera_T_object for frame in frames]
    if any(pose is None for pose in poses):
        return None, f"{path}: {unit}; no pose of the robot is given, so there is no truth"
    camera_T_object = np.array(poses)
    camera_T_object[:, :3, 3] *= metres
    camera_T_base = camera_T_object @ se3.make(_OBJECT_R_BASE, np.zeros(3))
    moved = se3.translation_error_m(camera_T_base[0], camera_T_base).max()
    turned = se3.rotation_error_rad(camera_T_base[0], camera_T_base).max()
    if moved > _SAME_CAMERA_M or turned > _SAME_CAMERA_RAD:
        raise InputError(f"{path}: the robot moves by {moved:.3f} m before the camera; {cure}")
    return se3.inverse(se3.mean(camera_T_base)), f"{path}: {unit}; truth: the pose that the set gives"


def _corners(frames: list[_Frame], keypoint: str, camera: CameraModel) -> Array:
    """(N, 1, 2) px, NaN where the keypoint is outside the picture or not given."""
    corners = np.array([[frame.pixels.get(keypoint, np.full(2, np.nan))] for frame in frames])
    with np.errstate(invalid="ignore"):
        outside = (corners < 0) | (corners > [camera.width - 1, camera.height - 1])
    corners[outside.any(-1)] = np.nan
    return corners


def _images(frames: list[_Frame]) -> tuple[Path | None, ...]:
    found: list[Path | None] = []
    for frame in frames:
        pictures = (frame.file.with_suffix(f".rgb{suffix}") for suffix in (".jpg", ".png"))
        found.append(next((picture for picture in pictures if picture.is_file()), None))
    return tuple(found)


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="dream",
        summary="a DREAM set in NDDS's layout, or one frame of it: NNNNNN.json, NNNNNN.rgb.jpg, _camera_settings.json",
        sniff=sniff,
        load=load,
    )
