"""A BOP scene written here: its cameras' reported poses are the hand."""

import json

import numpy as np
import pytest
from hecbench_datasets.formats import bop

from hecbench import se3
from hecbench.errors import InputError


@pytest.fixture
def scene(tmp_path, cell):
    from PIL import Image

    robot, target, flange_T_camera = cell(True, count=6)
    cameras, objects = {}, {}
    (tmp_path / "rgb").mkdir()
    for i, (pose, seen) in enumerate(zip(se3.inverse(robot), target, strict=True)):
        cameras[str(i)] = {
            "cam_K": [500.0, 0, 320, 0, 500, 240, 0, 0, 1],
            "cam_R_w2c": pose[:3, :3].ravel().tolist(),
            "cam_t_w2c": (1e3 * pose[:3, 3]).tolist(),
        }
        views = [(5, seen), (1, target[0])][: 2 if i else 1]
        objects[str(i)] = [
            {"obj_id": k, "cam_R_m2c": v[:3, :3].ravel().tolist(), "cam_t_m2c": (1e3 * v[:3, 3]).tolist()}
            for k, v in views
        ]
        Image.new("RGB", (640, 480)).save(tmp_path / "rgb" / f"{i:06d}.png")
    (tmp_path / "scene_camera.json").write_text(json.dumps(cameras))
    (tmp_path / "scene_gt.json").write_text(json.dumps(objects))
    return tmp_path, robot, target, flange_T_camera


def test_the_most_frequent_object_is_the_target(scene, sniffers, spread):
    folder, robot, target, flange_T_camera = scene
    assert sniffers(folder) == ["bop"]
    recording = bop.load(folder)
    np.testing.assert_allclose(recording.base_T_flange, robot, atol=1e-9)
    np.testing.assert_allclose(recording.camera_T_target, target, atol=1e-9)
    assert (recording.camera.width, recording.camera.K[0, 2]) == (640, 320)
    assert 1e3 * se3.translation_error_m(spread(recording)[2], flange_T_camera) < 0.01


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("scene_gt.json", "{}", "lists no object"),
        ("scene_gt.json", "[1, 2", "is not readable JSON"),
        ("scene_gt.json", '{"0": [{"obj_id": 5}]}', "has no 'cam_R_m2c'"),
        ("scene_gt.json", '{"0": 3}', "is not laid out"),
        ("scene_camera.json", "[]", "is not laid out"),
    ],
)
def test_faults_are_named(scene, name, content, message):
    folder = scene[0]
    (folder / name).write_text(content)
    with pytest.raises(InputError, match=message):
        bop.load(folder)
