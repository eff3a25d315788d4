"""DREAM's sets, in files made here in their layout from an arm's kinematics."""

import json

import numpy as np
import pytest
from hecbench_datasets.formats import dream
from hecbench_datasets.reading.arms import PANDA

from hecbench import se3
from hecbench.errors import InputError

LINKS = (
    "panda_link0",
    "panda_link2",
    "panda_link3",
    "panda_link4",
    "panda_link6",
    "panda_link7",
    "panda_hand",
)
K = np.array([[615.0, 0, 320], [0, 615, 240], [0, 0, 1]])
OBJECT_R_BASE = np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]])


def write(folder, cameras, unit=1.0, pose=False, image=True):
    """One frame for each camera_T_base; lengths times `unit`."""
    from PIL import Image

    rng = np.random.default_rng(1)
    sizes = {"width": 640, "height": 480}
    intrinsic = {"fx": K[0, 0], "fy": K[1, 1], "cx": K[0, 2], "cy": K[1, 2], "s": 0, "resolution": sizes}
    settings = {"camera_settings": [{"intrinsic_settings": intrinsic, "captured_image_size": sizes}]}
    folder.mkdir(exist_ok=True)
    (folder / "_camera_settings.json").write_text(json.dumps(settings))
    (folder / "_object_settings.json").write_text("{}")
    joints = rng.uniform(-1, 1, (len(cameras), 7)) * [1, 0.6, 1, 0.5, 1, 0.5, 1] + [0, 0, 0, -1.5, 0, 1.5, 0]
    for i, camera_T_base in enumerate(cameras):
        points = se3.transform_points(camera_T_base, PANDA.link_origins(joints[i], LINKS))
        pixels = (points @ K.T)[:, :2] / points[:, 2:]
        robot = {
            "class": "panda",
            "keypoints": [
                {"name": name, "location": (unit * p).tolist(), "projected_location": px.tolist()}
                for name, p, px in zip(LINKS, points, pixels, strict=True)
            ],
        }
        if pose:
            turned = camera_T_base @ se3.make(OBJECT_R_BASE.T, np.zeros(3))
            robot |= {
                "location": (unit * turned[:3, 3]).tolist(),
                "quaternion_xyzw": se3.to_quat_xyzw(turned).tolist(),
            }
        state = [{"name": f"panda/panda_joint{j + 1}", "position": q} for j, q in enumerate(joints[i])]
        state.append({"name": "panda/panda_finger_joint1", "position": 0.02})
        (folder / f"{i:06d}.json").write_text(
            json.dumps({"objects": [robot], "sim_state": {"joints": state}})
        )
        if image:
            Image.new("RGB", (640, 480)).save(folder / f"{i:06d}.rgb.jpg")
    return joints


@pytest.fixture
def camera_T_base():
    return se3.make(se3.so3_exp([1.2, -1.2, 1.1]), np.array([0.1, 0.2, 1.6]))


@pytest.mark.parametrize("unit", [1.0, 100.0])
def test_a_still_camera_is_found_from_the_keypoints(tmp_path, camera_T_base, unit, sniffers):
    joints = write(tmp_path / "real", [camera_T_base] * 12, unit)
    assert sniffers(tmp_path / "real") == ["dream"]
    recording = dream.load(tmp_path / "real")
    np.testing.assert_allclose(recording.truth_parent_T_camera, se3.inverse(camera_T_base), atol=1e-9)
    np.testing.assert_allclose(recording.joints_rad, joints)
    assert (recording.camera.width, recording.camera.K[0, 0]) == (640, 615)
    assert recording.sample_ids[0] == "000000"
    assert len(recording) == 12
    assert recording.image(3).shape == (480, 640, 3)
    assert "centimetres" in recording.notes[0] or unit == 1.0
    assert any("--urdf" in note for note in recording.notes)


def test_the_hand_is_the_keypoint(tmp_path, camera_T_base):
    """With the truth the recording's own keypoint is predicted to a pixel's rounding."""
    from hecbench_plugins.evaluators.keypoints import has_keypoints, pck

    from hecbench.estimate import Estimate

    write(tmp_path / "real", [camera_T_base] * 3)
    recording = dream.load(tmp_path / "real")
    assert has_keypoints(recording)
    found = pck(Estimate(recording.truth_parent_T_camera), recording, solve=None, rng=None)
    assert found["keypoint_mean_px"] < 1e-6


def test_a_moving_camera_needs_one_frame_named(tmp_path, camera_T_base, sniffers):
    moved = camera_T_base.copy()
    moved[:3, 3] += [0.2, 0, 0.3]
    write(tmp_path / "synthetic", [camera_T_base, moved], 100.0)
    with pytest.raises(InputError, match=r"the camera moves; name one frame: .*000000\.json"):
        dream.load(tmp_path / "synthetic")
    frame = tmp_path / "synthetic" / "000001.json"
    assert sniffers(frame) == ["dream"]
    recording = dream.load(frame)
    np.testing.assert_allclose(recording.truth_parent_T_camera, se3.inverse(moved), atol=1e-9)
    assert (recording.name, recording.sample_ids) == ("synthetic_000001", ("000001",))


def test_another_robot_has_the_pose_that_is_given(tmp_path, camera_T_base):
    write(tmp_path / "kuka", [camera_T_base] * 2, 100.0, pose=True)
    for file in (tmp_path / "kuka").glob("0*.json"):
        file.write_text(file.read_text().replace("panda", "iiwa7"))
    recording = dream.load(tmp_path / "kuka")
    np.testing.assert_allclose(recording.truth_parent_T_camera, se3.inverse(camera_T_base), atol=1e-9)
    assert recording.target is None
    assert recording.base_T_flange is None


def test_keypoints_outside_the_picture_are_not_seen(tmp_path, camera_T_base):
    write(tmp_path / "real", [camera_T_base] * 2, image=False)
    file = tmp_path / "real" / "000001.json"
    content = json.loads(file.read_text())
    content["objects"][0]["keypoints"][-1]["projected_location"] = [-999.9, 20.0]
    file.write_text(json.dumps(content))
    recording = dream.load(tmp_path / "real")
    assert np.isfinite(recording.corners_px[:, 0, 0]).tolist() == [True, False]
    assert recording.images == (None, None)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ('{"objects": []}', "lists no object"),
        ('{"objects": [{"keypoints": []}], "sim_state": {"joints": []}}', "names no keypoint"),
        ('{"objects": [{}], "sim_state": {}}', "has no 'joints'"),
        ('{"objects": 3', "is not readable JSON"),
        ('{"objects": {"a": 1}, "sim_state": {"joints": []}}', "is not laid out"),
    ],
)
def test_faults_are_named(tmp_path, camera_T_base, content, message):
    write(tmp_path / "real", [camera_T_base])
    (tmp_path / "real" / "000000.json").write_text(content)
    with pytest.raises(InputError, match=message):
        dream.load(tmp_path / "real")


def test_a_frame_without_a_joint_is_named(tmp_path, camera_T_base):
    write(tmp_path / "real", [camera_T_base] * 2)
    file = tmp_path / "real" / "000001.json"
    file.write_text(file.read_text().replace("panda_joint3", "panda_joint9"))
    with pytest.raises(InputError, match=r"sim_state\.joints: holds a number that is not finite"):
        dream.load(tmp_path / "real")
