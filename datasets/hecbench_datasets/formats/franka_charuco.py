"""franka-handeye folders: one `data.json` per pose with joints, `O_T_EE`, intrinsics and the target's pose.

Camera on the hand. The board's size stands beside them, but neither the marker dictionary nor the image size,
so the target poses are what can be used.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from hecbench.errors import InputError
from hecbench.recording import Mounting, Recording, RobotDescription
from hecbench.registry import hookimpl
from hecbench.specs import DatasetSpec
from hecbench_datasets.reading.hints import hints_for
from hecbench_datasets.reading.pairing import Documented, paired
from hecbench_datasets.reading.sources import finite, foreign, head, item, json_value, natural


def _samples(path: Path) -> list[Path]:
    folder = path / "captured-data" if (path / "captured-data").is_dir() else path
    return (
        sorted(folder.glob("*/data.json"), key=lambda file: natural(file.parent)) if folder.is_dir() else []
    )


def sniff(path: Path) -> bool:
    """A folder of `*/data.json` with Franka's `O_T_EE`."""
    found = _samples(path)
    return bool(found) and '"O_T_EE"' in head(found[0])


@foreign
def load(path: Path) -> Recording:
    """Read every sample whose board was detected."""
    joints, robot, target, ids = [], [], [], []
    for file in _samples(path):
        sample = json_value(file)
        if not item(sample, "charuco_detected", file):
            continue
        joints.append(finite(item(sample, "joint_pose", file), f"{file}: joint_pose", (7,)))
        robot.append(finite(item(sample, "O_T_EE", file), f"{file}: O_T_EE", (16,)))
        position = finite(item(sample, "T_cam_target_tvec", file), f"{file}: T_cam_target_tvec", (3,))
        rotvec = finite(item(sample, "T_cam_target_rvec", file), f"{file}: T_cam_target_rvec", (3,))
        target.append(np.concatenate([position, rotvec]))
        ids.append(file.parent.name)
    if not ids:
        raise InputError(f"{path}: holds no */data.json with charuco_detected; check the folder")
    hints, _ = hints_for(path)
    documented = Documented(mounting=Mounting.EYE_IN_HAND, target_rotation="rotvec")
    return paired(
        path,
        robot,
        target,
        documented,
        hints,
        ids=ids,
        joints_rad=np.array(joints),
        robot=RobotDescription(
            base_link="panda_link0",
            flange_link="panda_EE",
            joint_names=tuple(f"panda_joint{i}" for i in range(1, 8)),
        ),
        camera=hints.camera_model(),
    )


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="franka_charuco",
        summary="franka-handeye: pose_*/data.json with joints, O_T_EE and the ChArUco board's pose",
        sniff=sniff,
        load=load,
    )
