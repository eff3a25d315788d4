"""Zivid's folders in millimetres."""

import numpy as np
import pytest
from hecbench_datasets.formats import zivid

from hecbench.errors import InputError
from hecbench.recording import Mounting
from hecbench.targets import ChessboardTarget


def matrix(pose):
    """A transform as Zivid's SDK saves it, mm."""
    millimetres = pose.copy()
    millimetres[:3, 3] *= 1e3
    return f"__version__:\n  serializer: 1\n  data: 1\nFloatMatrix:\n  Data: {millimetres.tolist()}\n"


def opencv(pose):
    """A transform as Zivid's samples save it, mm."""
    values = pose.copy()
    values[:3, 3] *= 1e3
    listed = ", ".join(map(repr, values.ravel().tolist()))
    return f"%YAML:1.0\n---\nPoseState: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: d\n   data: [ {listed} ]\n"


@pytest.mark.parametrize("write", [matrix, opencv])
@pytest.mark.parametrize("eye_in_hand", [True, False])
def test_board_poses_prove_the_mounting(tmp_path, sniffers, cell, write, eye_in_hand):
    robot, target, _ = cell(eye_in_hand, count=12)
    for i, (a, b) in enumerate(zip(robot, target, strict=True)):
        (tmp_path / f"robot_pose_{i}.yaml").write_text(write(a))
        (tmp_path / f"checkerboard_pose_in_camera_frame_{i}.yaml").write_text(write(b))
    assert sniffers(tmp_path) == ["zivid"]
    recording = zivid.load(tmp_path)
    assert recording.mounting is (Mounting.EYE_IN_HAND if eye_in_hand else Mounting.EYE_TO_HAND)
    assert recording.sample_ids[10] == "10"
    np.testing.assert_allclose(recording.base_T_flange, robot, atol=1e-6)
    np.testing.assert_allclose(recording.camera_T_target, target, atol=1e-6)
    assert "in mm" in recording.notes[0]


def test_pictures_need_hints(tmp_path, cell):
    from PIL import Image

    robot, _, _ = cell(True, count=3)
    for i, pose in enumerate(robot, 1):
        (tmp_path / f"pos{i:02d}.yaml").write_text(opencv(pose))
        Image.new("RGB", (8, 6)).save(tmp_path / f"img{i:02d}.png")
    with pytest.raises(InputError, match="give mounting and target in hecbench-import"):
        zivid.load(tmp_path)
    (tmp_path / "hecbench-import.yaml").write_text(
        "mounting: eye_in_hand\ncamera: {width: 8, height: 6}\n"
        "target: {kind: chessboard, columns: 7, rows: 6, square_m: 0.03}\n"
    )
    recording = zivid.load(tmp_path)
    assert recording.target == ChessboardTarget(7, 6, 0.03)
    np.testing.assert_allclose(recording.base_T_flange, robot, atol=1e-9)
    assert [image.name for image in recording.images] == ["img01.png", "img02.png", "img03.png"]


def test_a_file_without_a_matrix_is_named(tmp_path):
    (tmp_path / "robot_pose_0.yaml").write_text("FloatMatrix: {Data: [[1, 0], [0, 1]]}\n")
    (tmp_path / "checkerboard_pose_in_camera_frame_0.yaml").write_text("{}\n")
    with pytest.raises(InputError, match=r"robot_pose_0\.yaml: holds no 4x4 matrix"):
        zivid.load(tmp_path)
