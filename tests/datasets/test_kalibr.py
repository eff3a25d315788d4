"""Kalibr's target files and camera chains beside the pictures."""

import numpy as np
import pytest
from hecbench_datasets.reading import cameras, kalibr
from PIL import Image

from hecbench.errors import InputError
from hecbench.lens import EQUIDISTANT
from hecbench.targets import AprilGridTarget, ChessboardTarget, PointsTarget

CHAIN = """
cam0:
  camera_model: pinhole
  intrinsics: [458.654, 457.296, 367.215, 248.375]
  distortion_model: {lens}
  distortion_coeffs: [-0.01, 0.02, -0.003, 0.001]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
"""


def written(folder, name, text):
    (folder / name).write_text(text)
    return [folder / name]


def picture(folder, size=(752, 480)):
    Image.new("RGB", size).save(folder / "a.png")
    return folder / "a.png"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "target_type: 'aprilgrid'\ntagCols: 6\ntagRows: 5\ntagSize: 0.088\ntagSpacing: 0.3\n",
            AprilGridTarget(6, 5, 0.088, 0.3),
        ),
        (
            "target_type: checkerboard\ntargetCols: 7\ntargetRows: 6\nrowSpacingMeters: 0.06\ncolSpacingMeters: 0.06\n",
            ChessboardTarget(7, 6, 0.06),
        ),
        (
            "target_type: checkerboard\ntargetCols: 2\ntargetRows: 2\nrowSpacingMeters: 0.05\ncolSpacingMeters: 0.06\n",
            PointsTarget.of([[0, 0, 0], [0.06, 0, 0], [0, 0.05, 0], [0.06, 0.05, 0]]),
        ),
        (
            "target_type: circlegrid\ntargetCols: 2\ntargetRows: 2\nspacingMeters: 0.02\nasymmetricGrid: False\n",
            PointsTarget.of([[0, 0, 0], [0.02, 0, 0], [0, 0.02, 0], [0.02, 0.02, 0]]),
        ),
    ],
)
def test_targets(tmp_path, text, expected):
    notes = []
    assert kalibr.target_in(written(tmp_path, "target.yaml", text), notes) == expected
    assert notes == [f"{tmp_path}: target from target.yaml"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("target_type: aprilgrid\ntagCols: 6\ntagRows: 5\ntagSize: 0.088\n", "needs tagSpacing"),
        ("target_type: aprilgrid\ntagCols: x\ntagRows: 5\ntagSize: 0.088\ntagSpacing: 0.3\n", "target.yaml"),
        ("target_type: aprilgrid\ntagCols: 6\ntagRows: 5\ntagSize: -1\ntagSpacing: 0.3\n", "tag_m"),
        (
            "target_type: circlegrid\ntargetCols: 2\ntargetRows: 2\nspacingMeters: 0.02\nasymmetricGrid: True\n",
            "symmetric circlegrid",
        ),
    ],
)
def test_wrong_targets_are_named(tmp_path, text, message):
    with pytest.raises(InputError, match=message):
        kalibr.target_in(written(tmp_path, "target.yaml", text), [])


def test_a_file_for_others_is_none(tmp_path):
    assert kalibr.target_in(written(tmp_path, "robot.yaml", "name: arm\n"), []) is None


@pytest.mark.parametrize(("lens", "model"), [("radtan", "opencv"), ("equidistant", EQUIDISTANT)])
def test_camera_chains(tmp_path, lens, model):
    camera, (note,) = cameras.camera_in(
        written(tmp_path, "camchain.yaml", CHAIN.format(lens=lens)), picture(tmp_path)
    )
    np.testing.assert_allclose(camera.K, [[458.654, 0, 367.215], [0, 457.296, 248.375], [0, 0, 1]])
    np.testing.assert_allclose(camera.distortion, [-0.01, 0.02, -0.003, 0.001])
    assert camera.distortion_model == model
    assert "camchain.yaml" in note


@pytest.mark.parametrize(
    ("text", "size", "message"),
    [
        (CHAIN.format(lens="fov"), (752, 480), "distortion_model 'fov' is not read"),
        (CHAIN.format(lens="radtan").replace("pinhole", "omni"), (752, 480), "camera_model 'omni'"),
        (CHAIN.format(lens="radtan"), (640, 480), "752x480 px, the pictures have 640x480"),
    ],
)
def test_chains_of_other_cameras_are_named(tmp_path, text, size, message):
    camera, (note,) = cameras.camera_in(written(tmp_path, "camchain.yaml", text), picture(tmp_path, size))
    assert camera is None
    assert message in note


def test_a_camera_model_is_not_yet_kalibr(tmp_path):
    text = "camera_model: pinhole\nfx: 400\nfy: 401\ncx: 320\ncy: 240\n"
    camera, _ = cameras.camera_in(written(tmp_path, "camera.yaml", text), picture(tmp_path, (640, 480)))
    np.testing.assert_allclose(np.diag(camera.K), [400, 401, 1])


def test_an_equidistant_camera_info(tmp_path):
    text = (
        "image_width: 640\nimage_height: 480\ndistortion_model: equidistant\n"
        "camera_matrix: {rows: 3, cols: 3, data: [400, 0, 320, 0, 400, 240, 0, 0, 1]}\n"
        "distortion_coefficients: {rows: 1, cols: 4, data: [0.1, 0.01, 0.0, 0.0]}\n"
    )
    camera, _ = cameras.camera_in(written(tmp_path, "camera_info.yaml", text), picture(tmp_path, (640, 480)))
    assert camera.distortion_model == EQUIDISTANT
    assert len(camera.distortion) == 4
