"""moveit_calibration samples, whose mounting the poses must prove."""

import json

import numpy as np
import pytest
import yaml
from hecbench_datasets.formats import moveit

from hecbench.errors import InputError
from hecbench.recording import Mounting


@pytest.fixture(params=[True, False], ids=["in_hand", "to_hand"])
def samples(request, cell):
    robot, target, _ = cell(request.param)
    mounting = Mounting.EYE_IN_HAND if request.param else Mounting.EYE_TO_HAND
    listed = [
        {"effector_wrt_world": a.ravel().tolist(), "object_wrt_sensor": b.ravel().tolist()}
        for a, b in zip(robot, target, strict=True)
    ]
    return listed, mounting, robot


@pytest.mark.parametrize("write", [yaml.safe_dump, json.dumps])
def test_the_poses_prove_the_mounting(tmp_path, sniffers, samples, write):
    listed, mounting, robot = samples
    file = tmp_path / f"samples.{'json' if write is json.dumps else 'yaml'}"
    file.write_text(write(listed))
    assert sniffers(tmp_path) == ["moveit"]
    recording = moveit.load(tmp_path)
    assert recording.mounting is mounting
    np.testing.assert_allclose(recording.base_T_flange, robot, atol=1e-9)
    assert str(mounting) in recording.notes[0]


def test_joint_states_beside_them_are_read(tmp_path, samples):
    listed, _, _ = samples
    (tmp_path / "samples.yaml").write_text(yaml.safe_dump(listed))
    joints = {"joint_names": ["a", "b"], "joint_values": [[0.1, 0.2 * i] for i in range(len(listed))]}
    (tmp_path / "joints.yaml").write_text(yaml.safe_dump(joints))
    recording = moveit.load(tmp_path)
    assert recording.robot.joint_names == ("a", "b")
    assert recording.joints_rad[3, 1] == pytest.approx(0.6)


def test_faults_name_the_sample(tmp_path, samples):
    listed, _, _ = samples
    listed[2]["object_wrt_sensor"] = listed[2]["object_wrt_sensor"][:15]
    file = tmp_path / "samples.yaml"
    file.write_text(yaml.safe_dump(listed))
    with pytest.raises(InputError, match=r"samples\.yaml: sample 2: object_wrt_sensor"):
        moveit.load(file)
