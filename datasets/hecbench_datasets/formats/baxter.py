"""The Baxter set for keypoints: 20 poses of a left arm, several pictures each, the end-effector labelled in 2D and 3D.

Lu, Richter and Yip 2020, "Robust keypoint detection and pose estimation of robot manipulators with self-occlusions via
sim-to-real transfer". ``ground_truth_data`` is a pickle of ``pose_N -> joints, ee_2d px, ee_3d m`` in the camera's
frame, ``pose_N/*.png`` the pictures. The camera stands still, so the arm's kinematics laid onto the labelled 3D points
tell where: that is the truth, as good as the note says. The labelled pixel is a keypoint, see docs/evaluators.md.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import CameraModel, Mounting, Recording, RobotDescription
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import DatasetSpec
from hecbench.targets import PointsTarget
from hecbench_datasets.reading.arms import BAXTER_END_EFFECTOR_M, BAXTER_LEFT
from hecbench_datasets.reading.pickles import plain_pickle
from hecbench_datasets.reading.rigid import rigid_fit
from hecbench_datasets.reading.robots import NO_START, urdf_beside
from hecbench_datasets.reading.sources import IMAGE_SUFFIXES, files_in, finite, foreign, item, natural

_LABELS = "ground_truth_data"
_SIZE_PX = (2048, 1536)
_K = np.array([[960.41357421875, 0, 1021.7171020507812], [0, 960.22314453125, 776.2381591796875], [0, 0, 1]])
"""Of the set's publication; no file of the set tells them."""
_LEAST_POSES = 3
_WORST_M = 0.05


def sniff(path: Path) -> bool:
    """A folder with the labels and folders of poses."""
    return (path / _LABELS).is_file() and any(path.glob("pose_*"))


@foreign
def load(path: Path) -> Recording:
    """Read every picture; a pose without one is a sample without a picture."""
    file = path / _LABELS
    labels = plain_pickle(file)
    if not isinstance(labels, dict) or not labels:
        raise InputError(f"{file}: holds no poses")
    poses = sorted(labels, key=natural)

    def values(name: str, length: int) -> Array:
        rows = [np.ravel(item(labels[pose], name, f"{file}: {pose}")) for pose in poses]
        return finite(rows, f"{file}: {name}", (len(poses), length))

    joints, pixels, points_c = values("joints", 7), values("ee_2d", 2), values("ee_3d", 3)
    base_T_flange = BAXTER_LEFT.base_T_flange(joints)
    truth, note = _truth(path, base_T_flange, points_c)
    pictures: list[list[Path | None]] = [
        [*files_in(path / pose, *IMAGE_SUFFIXES)] or [None] for pose in poses
    ]
    of_pose = np.repeat(np.arange(len(poses)), [len(found) for found in pictures])
    urdf, notes = urdf_beside(path, "a Baxter")
    return Recording(
        name=f"baxter_{path.resolve().name}",
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=tuple(
            f"{pose}_{i:03d}" for pose, found in zip(poses, pictures, strict=True) for i in range(len(found))
        ),
        robot=RobotDescription(
            urdf=urdf,
            base_link=BAXTER_LEFT.base_link,
            flange_link=BAXTER_LEFT.flange_link,
            joint_names=BAXTER_LEFT.joint_names,
        ),
        camera=CameraModel(*_SIZE_PX, _K),
        target=PointsTarget((BAXTER_END_EFFECTOR_M,)),
        corners_px=pixels[of_pose, None],
        truth_parent_T_camera=truth,
        base_T_flange=base_T_flange[of_pose],
        joints_rad=joints[of_pose],
        images=tuple(picture for found in pictures for picture in found),
        folder=path,
        notes=(note, *notes, NO_START.format(path)),
    )


def _truth(path: Path, base_T_flange: Array, points_c: Array) -> tuple[Array | None, str]:
    """base_T_camera from the labelled end-effector, and how well it fits."""
    if len(points_c) < _LEAST_POSES:
        return None, f"{path}: {len(points_c)} poses are too few to tell where the camera stands: no truth"
    points_b = se3.transform_points(base_T_flange, np.array([BAXTER_END_EFFECTOR_M]))[:, 0]
    base_T_camera, rms_m = rigid_fit(points_c, points_b)
    difference = (
        f"the arm's kinematics and {len(points_c)} labelled points differ by {1e3 * rms_m:.1f} mm rms"
    )
    if rms_m > _WORST_M:
        return None, f"{path}: no truth: {difference}"
    return base_T_camera, f"{path}: truth: {difference}"


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="baxter",
        summary="the Baxter keypoint set: ground_truth_data, pose_N/*.png",
        sniff=sniff,
        load=load,
    )
