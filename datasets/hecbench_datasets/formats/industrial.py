"""ROS-Industrial `industrial_calibration` folders: `cal_data.yaml`, poses, images of a circle grid.

Poses are base_T_tool. The circle grid's origin is the centre of its large dot; the mounts' guesses are where
the authors start from.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import CameraModel, Mounting, Recording, RobotDescription
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import DatasetSpec
from hecbench.system import pictures
from hecbench.targets import Target
from hecbench_datasets.reading.hints import circle_grid, hinted_target, hints_for
from hecbench_datasets.reading.sources import FileOfFormat, finite, foreign, item, yaml_value

_QUATERNION = ("x", "y", "z", "qx", "qy", "qz", "qw")

_FILE = FileOfFormat(
    shows=lambda text: "target_finder" in text,
    described="cal_data.yaml with a target_finder; check the folder",
    names=("cal_data.yaml", "data.yaml"),
    first=20000,
)


@foreign
def load(path: Path) -> Recording:
    """Read poses, camera and target; the images are for the detector."""
    file = _FILE.of(path)
    content = yaml_value(file)
    entries = item(content, "data", file)
    if not isinstance(entries, list) or not entries:
        raise InputError(f"{file}: data: expected a list of {{pose, image}}")
    pose_files = [file.parent / str(item(entry, "pose", file)) for entry in entries]
    images = tuple(file.parent / str(item(entry, "image", file)) for entry in entries)
    hints, hints_file = hints_for(path)
    static = bool(item(content, "static_camera", file))
    guess = content.get("camera_mount_to_camera_guess")
    return Recording(
        name=file.parent.resolve().name,
        mounting=hints.mounting or (Mounting.EYE_TO_HAND if static else Mounting.EYE_IN_HAND),
        sample_ids=tuple(pose_file.stem for pose_file in pose_files),
        robot=RobotDescription(base_link="base_link", flange_link="tool0"),
        camera=hints.camera_model() or _camera(content, file, images[0]),
        target=hinted_target(hints, hints_file) or _target(content, file),
        initial_parent_T_camera=None if guess is None else _pose(guess, file),
        base_T_flange=np.array([_pose(yaml_value(pose_file), pose_file) for pose_file in pose_files]),
        images=images,
        folder=file.parent,
    )


def _pose(values: Any, file: Path) -> Array:
    numbers = finite([item(values, key, file) for key in _QUATERNION], f"{file}: pose", (7,))
    if abs(np.linalg.norm(numbers[3:]) - 1) > 1e-2:
        raise InputError(f"{file}: qx qy qz qw is not of unit length; check the pose")
    return se3.from_quat_xyzw(numbers[3:], numbers[:3])


def _camera(content: Any, file: Path, image: Path) -> CameraModel:
    intrinsics = content.get("intrinsics")
    size = pictures.size(image)
    if intrinsics is None:
        return CameraModel(*size)
    fx, fy, cx, cy = finite([item(intrinsics, key, file) for key in ("fx", "fy", "cx", "cy")], str(file))
    return CameraModel(*size, np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]]))


def _target(content: Any, file: Path) -> Target:
    finder = content["target_finder"]
    if "CircleGrid" not in str(item(finder, "type", file)):
        raise InputError(f"{file}: target_finder.type '{finder['type']}' is not a circle grid")
    rows, columns, spacing = (
        float(finite(item(finder, key, file), f"{file}: {key}", (1,))[0])
        for key in ("rows", "cols", "spacing")
    )
    return circle_grid(int(columns), int(rows), spacing)


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="industrial",
        summary="ROS-Industrial calibration folder: cal_data.yaml, poses, images of a circle grid",
        sniff=_FILE.sniff,
        load=load,
    )
