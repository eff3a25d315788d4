"""easy_handeye samples (ROS 1 and 2): YAML with `samples` of robot and tracking transforms, or a SampleList.

easy_handeye stores base_T_flange when the camera is on the hand and flange_T_base when it is not, so the
samples alone cannot tell the mounting. The calibration file beside them (`parameters: eye_on_hand ...`) does,
and its `transformation` becomes the start.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.exchange.conventions import HINTS_NAME
from hecbench.recording import Mounting, Recording, RobotDescription
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import DatasetSpec
from hecbench_datasets.reading.hints import hints_for
from hecbench_datasets.reading.pairing import Documented, paired
from hecbench_datasets.reading.sources import (
    YAML_SUFFIXES,
    FileOfFormat,
    files_in,
    finite,
    foreign,
    head,
    item,
    yaml_value,
)

_SUFFIXES = (*YAML_SUFFIXES, ".samples", ".calib")
_TRACKING = ("tracking", "optical", "opt")
_LISTS = ("hand_world_samples", "camera_marker_samples")


def _is_samples(content: str) -> bool:
    listed = "samples:" in content and "robot:" in content and any(f"{key}:" in content for key in _TRACKING)
    return listed or any(f"{key}:" in content for key in _LISTS)


_FILE = FileOfFormat(shows=_is_samples, described="easy_handeye samples; check the file", suffixes=_SUFFIXES)


@foreign
def load(path: Path) -> Recording:
    """Read the samples, and the calibration file beside them."""
    file = _FILE.of(path)
    content = yaml_value(file)
    robot, target = _listed(content, file) if _LISTS[0] in content else _paired_samples(content, file)
    parameters, start = _calibration(file)
    hints, _ = hints_for(path)
    on_hand = parameters.get("eye_on_hand", parameters.get("calibration_type") == "eye_in_hand" or None)
    mounting = hints.mounting
    if mounting is None and on_hand is not None:
        mounting = Mounting.EYE_IN_HAND if on_hand else Mounting.EYE_TO_HAND
    if mounting is None:
        raise InputError(
            f"{file}: easy_handeye stores the robot poses inverted when the camera is fixed, and this file "
            f"does not say where it was; write 'mounting: eye_in_hand' or eye_to_hand into {HINTS_NAME}"
        )
    documented = Documented(
        mounting=mounting,
        robot_inverted=mounting is Mounting.EYE_TO_HAND,
        robot_rotation="quat_xyzw",
        target_rotation="quat_xyzw",
    )
    return paired(
        file,
        robot,
        target,
        documented,
        hints,
        robot=RobotDescription(
            base_link=parameters.get("robot_base_frame", "base_link"),
            flange_link=parameters.get("robot_effector_frame", "tool0"),
        ),
        initial_parent_T_camera=start,
        camera=hints.camera_model(),
    )


def _paired_samples(content: Any, file: Path) -> tuple[list[Array], list[Array]]:
    samples = item(content, "samples", file)
    robot, target = [], []
    for i, sample in enumerate(samples if isinstance(samples, list) else ()):
        tracking = next((key for key in _TRACKING if isinstance(sample, dict) and key in sample), "tracking")
        robot.append(_transform(item(sample, "robot", file), f"{file}: samples[{i}].robot"))
        target.append(_transform(item(sample, tracking, file), f"{file}: samples[{i}].{tracking}"))
    if not robot:
        raise InputError(f"{file}: samples: is empty")
    return robot, target


def _listed(content: Any, file: Path) -> tuple[list[Array], list[Array]]:
    robot, target = (
        [
            _transform(value, f"{file}: {key}[{i}]")
            for i, value in enumerate(item(item(content, key, file), "transforms", file))
        ]
        for key in _LISTS
    )
    return robot, target


def _transform(value: Any, source: str) -> Array:
    """Position and quaternion x y z w (7,) of a ROS Transform, stamped or not."""
    value = value.get("transform", value) if isinstance(value, dict) else value
    translation, rotation = item(value, "translation", source), item(value, "rotation", source)
    numbers = [item(translation, key, source) for key in "xyz"] + [
        item(rotation, key, source) for key in "xyzw"
    ]
    return finite(numbers, source, (7,))


def _calibration(samples: Path) -> tuple[dict[str, Any], Array | None]:
    """The parameters and the published parent_T_camera of the calibration file beside the samples, if any."""
    for file in files_in(samples.parent, *_SUFFIXES):
        if "parameters:" not in head(file):
            continue
        content = yaml_value(file)
        parameters = item(content, "parameters", file)
        values = content.get("transformation")
        if not isinstance(parameters, dict):
            raise InputError(f"{file}: parameters: expected names and values")
        if values is None:
            return parameters, None
        keys = ("x", "y", "z", "qx", "qy", "qz", "qw")
        numbers = finite([item(values, key, file) for key in keys], f"{file}: transformation")
        if abs(np.linalg.norm(numbers[3:]) - 1) > 1e-2:
            raise InputError(f"{file}: transformation: qx qy qz qw is not of unit length")
        return parameters, se3.from_quat_xyzw(numbers[3:], numbers[:3])
    return {}, None


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="easy_handeye",
        summary="easy_handeye samples of ROS 1 and 2 (YAML), with the calibration file beside them",
        sniff=_FILE.sniff,
        load=load,
    )
