"""ROS-Industrial kinematic calibration: `measurements.yaml` with joint positions and target poses.

There is no robot model beside it, so the recording holds joints and camera_T_target only. The joints that
move the target and not the camera make it eye to hand; the guesses file gives the authors' start.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import Mounting, Recording
from hecbench.registry import hookimpl
from hecbench.specs import DatasetSpec
from hecbench_datasets.reading.sources import FileOfFormat, finite, foreign, item, yaml_value

_FILE = FileOfFormat(
    shows=lambda text: "target_joints" in text,
    described="measurements.yaml with target_joints; check the folder",
    names=("measurements.yaml",),
)


@foreign
def load(path: Path) -> Recording:
    """Read joints and target poses."""
    file = _FILE.of(path)
    content = yaml_value(file)
    poses = [item(sample, "pose", file) for sample in content.values()]
    numbers = finite(
        [[item(pose, key, file) for key in ("x", "y", "z", "qx", "qy", "qz", "qw")] for pose in poses],
        f"{file}: pose",
    )
    moving = {
        mounting: finite([item(sample, key, file) for sample in content.values()], f"{file}: {key}")
        for mounting, key in (
            (Mounting.EYE_TO_HAND, "target_joints"),
            (Mounting.EYE_IN_HAND, "camera_joints"),
        )
    }
    used = [mounting for mounting, joints in moving.items() if joints.size]
    if len(used) != 1:
        raise InputError(f"{file}: target_joints and camera_joints must not both be given, or both be empty")
    return Recording(
        name=file.parent.resolve().name,
        mounting=used[0],
        sample_ids=tuple(map(str, content)),
        joints_rad=moving[used[0]],
        camera_T_target=se3.from_quat_xyzw(numbers[:, 3:], numbers[:, :3]),
        camera_stamp_s=np.array([float(stamp) for stamp in content]) if _all_numbers(content) else None,
        folder=file.parent,
    )


def _all_numbers(names: Iterable[object]) -> bool:
    return all(str(name).replace(".", "", 1).isdecimal() for name in names)


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="industrial_kinematic",
        summary="ROS-Industrial kinematic calibration: measurements.yaml with joints and target poses",
        sniff=_FILE.sniff,
        load=load,
    )
