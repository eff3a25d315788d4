"""Tables whose conventions nobody wrote down."""

import numpy as np
import pytest
from hecbench_datasets.formats import pose_tables
from scipy.spatial.transform import Rotation

from hecbench import se3
from hecbench.errors import InputError
from hecbench.preparation import load_recording
from hecbench.recording import Mounting


def test_universal_robots_poses_and_quaternions_scalar_first(tmp_path, sniffers, cell):
    robot, target, _ = cell(False)
    lines = [
        "p[" + ", ".join(f"{v:.9f}" for v in [*pose[:3, 3], *se3.so3_log(pose[:3, :3])]) + "]"
        for pose in robot
    ]
    (tmp_path / "robot.txt").write_text("\n".join(lines) + "\n")
    np.savetxt(
        tmp_path / "target.csv", np.hstack([1e3 * target[:, :3, 3], se3.to_quat_wxyz(target)]), delimiter=";"
    )
    assert sniffers(tmp_path) == []
    recording = load_recording(tmp_path)
    assert recording.mounting is Mounting.EYE_TO_HAND
    np.testing.assert_allclose(recording.base_T_flange, robot, atol=1e-6)
    np.testing.assert_allclose(recording.camera_T_target, target, atol=1e-6)
    assert "base_T_flange rotvec in m, camera_T_target quat_wxyz in mm" in recording.notes[0]


def test_kuka_angles_beside_matrices(tmp_path, cell):
    robot, target, _ = cell(True)
    angles = Rotation.from_matrix(robot[:, :3, :3]).as_euler("ZYX", degrees=True)
    header = "X Y Z A B C"
    np.savetxt(tmp_path / "robot_poses.csv", np.hstack([1e3 * robot[:, :3, 3], angles]), header=header)
    np.savetxt(tmp_path / "marker.txt", target.reshape(-1, 16), delimiter="\t")
    recording = pose_tables.load(tmp_path)
    assert recording.mounting is Mounting.EYE_IN_HAND
    np.testing.assert_allclose(recording.base_T_flange, robot, atol=1e-6)


def test_hints_settle_what_is_ambiguous(tmp_path, cell):
    robot, target, _ = cell(True)
    np.savetxt(tmp_path / "robot.csv", se3.inverse(robot).reshape(-1, 16))
    np.savetxt(tmp_path / "target.csv", target.reshape(-1, 16))
    (tmp_path / "hecbench-import.yaml").write_text("robot_pose: flange_T_base\nmounting: eye_in_hand\n")
    np.testing.assert_allclose(pose_tables.load(tmp_path).base_T_flange, robot, atol=1e-9)


def test_beside_pictures_the_convention_must_be_told(tmp_path, cell):
    from PIL import Image

    robot, _, _ = cell(True, count=3)
    np.savetxt(tmp_path / "robot.csv", np.hstack([robot[:, :3, 3], se3.so3_log(robot[:, :3, :3])]))
    for i in range(3):
        Image.new("RGB", (8, 6)).save(tmp_path / f"{i}.png")
    with pytest.raises(InputError, match=r"3 pictures beside .* no target was recognised in them"):
        pose_tables.load(tmp_path)
    (tmp_path / "hecbench-import.yaml").write_text("robot_rotation: rotvec\nmounting: eye_in_hand\n")
    recording = pose_tables.load(tmp_path)
    np.testing.assert_allclose(recording.base_T_flange, robot, atol=1e-9)
    (tmp_path / "2.png").unlink()
    with pytest.raises(InputError, match=r"2 pictures for 3 rows of robot\.csv"):
        pose_tables.load(tmp_path)
