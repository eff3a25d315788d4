"""The Baxter keypoint set, in files made here in its layout from the arm's kinematics."""

import pickle

import numpy as np
import pytest
from hecbench_datasets.formats import baxter
from hecbench_datasets.reading.arms import BAXTER_END_EFFECTOR_M, BAXTER_LEFT
from hecbench_plugins.evaluators.keypoints import add, pck

from hecbench import se3
from hecbench.errors import InputError
from hecbench.estimate import Estimate

CAMERA_T_BASE = se3.make(se3.so3_exp([1.1, -1.3, 1.0]), np.array([-0.5, 0.1, 1.5]))


def write(folder, noise_m=0.0, poses=20, pictures=2):
    from PIL import Image

    rng = np.random.default_rng(2)
    labels = {}
    for i in range(poses):
        joints = rng.uniform(-0.8, 0.8, 7)
        end = se3.transform_points(BAXTER_LEFT.base_T_flange(joints), np.array([BAXTER_END_EFFECTOR_M]))
        point = se3.transform_points(CAMERA_T_BASE, end)[0]
        pixel = (baxter._K @ point)[:2] / point[2]
        labels[f"pose_{i}"] = {
            "joints": joints.tolist(),
            "ee_2d": pixel.reshape(2, 1),
            "ee_3d": point + rng.normal(0, noise_m, 3),
        }
        (folder / f"pose_{i}").mkdir(parents=True)
        for k in range(pictures):
            (folder / f"pose_{i}" / f"{k}.png").touch()
    if pictures:
        Image.new("RGB", (2048, 1536)).save(folder / "pose_0" / "0.png")
    (folder / "ground_truth_data").write_bytes(pickle.dumps(labels, protocol=2))


def test_the_set_is_read_with_its_truth(tmp_path, sniffers):
    write(tmp_path / "set")
    assert sniffers(tmp_path / "set") == ["baxter"]
    recording = baxter.load(tmp_path / "set")
    assert len(recording) == 40
    assert recording.sample_ids[:4] == ("pose_0_000", "pose_0_001", "pose_1_000", "pose_1_001")
    assert recording.sample_ids[20] == "pose_10_000"
    np.testing.assert_allclose(recording.truth_parent_T_camera, se3.inverse(CAMERA_T_BASE), atol=1e-9)
    assert recording.image(0).shape == (1536, 2048, 3)
    assert recording.images[39].name == "1.png"


def test_the_protocol_on_the_truth_and_on_a_shift(tmp_path):
    write(tmp_path / "set")
    recording = baxter.load(tmp_path / "set")
    exact = pck(Estimate(recording.truth_parent_T_camera), recording, solve=None, rng=None)
    assert (exact["keypoints"], exact["keypoint_poses"]) == (40, 20)
    assert exact["keypoint_mean_px"] < 1e-6
    shifted = Estimate(recording.truth_parent_T_camera @ se3.make(np.eye(3), [0.1, 0, 0]))
    assert add(shifted, recording, solve=None, rng=None)["add_mm"] == pytest.approx(100.0)
    assert pck(shifted, recording, solve=None, rng=None)["pck_20_px"] < 0.5


def test_noise_in_the_labels_is_told_and_too_much_is_no_truth(tmp_path):
    write(tmp_path / "some", noise_m=0.01)
    recording = baxter.load(tmp_path / "some")
    assert "differ by 1" in recording.notes[0]
    found = se3.translation_error_m(recording.truth_parent_T_camera, se3.inverse(CAMERA_T_BASE))
    assert 1e-4 < found < 0.05
    write(tmp_path / "much", noise_m=0.2)
    assert baxter.load(tmp_path / "much").truth_parent_T_camera is None


def test_without_pictures_the_labels_remain(tmp_path):
    write(tmp_path / "set", pictures=0, poses=2)
    recording = baxter.load(tmp_path / "set")
    assert recording.images == (None, None)
    assert recording.truth_parent_T_camera is None
    assert "too few" in recording.notes[0]


@pytest.mark.parametrize(
    ("labels", "message"),
    [
        ({}, "holds no poses"),
        ({"pose_0": {"joints": [0] * 7, "ee_2d": [1, 2]}}, "has no 'ee_3d'"),
        (
            {"pose_0": {"joints": [0] * 6, "ee_2d": [1, 2], "ee_3d": [1, 2, 3]}},
            "joints: expected numbers of shape",
        ),
        ([1, 2], "holds no poses"),
    ],
)
def test_faults_are_named(tmp_path, labels, message):
    (tmp_path / "pose_0").mkdir()
    (tmp_path / "ground_truth_data").write_bytes(pickle.dumps(labels))
    with pytest.raises(InputError, match=message):
        baxter.load(tmp_path)
