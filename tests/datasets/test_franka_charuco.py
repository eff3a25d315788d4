"""The twelve samples of franka-handeye."""

import json
import shutil

import numpy as np
import pytest
from hecbench_datasets.formats import franka_charuco

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import Mounting


def test_real_samples_reach_the_reference(data, sniffers, spread):
    folder = data / "franka_charuco"
    assert sniffers(folder) == ["franka_charuco"]
    recording = franka_charuco.load(folder)
    assert (len(recording), recording.mounting) == (12, Mounting.EYE_IN_HAND)
    assert recording.joints_rad.shape == (12, 7)
    rotation_deg, translation_mm, flange_T_camera = spread(recording)
    assert (rotation_deg, translation_mm) == pytest.approx((0.72, 3.4), rel=0.02)
    published = np.array(json.loads((folder / "calibration_result.json").read_text())["T_cam_gripper"])
    assert 1e3 * se3.translation_error_m(published, flange_T_camera) < 5


def test_a_missing_key_names_the_file(data, tmp_path):
    shutil.copytree(data / "franka_charuco" / "captured-data", tmp_path / "copy", copy_function=shutil.copy)
    file = tmp_path / "copy" / "pose_03" / "data.json"
    sample = json.loads(file.read_text())
    del sample["O_T_EE"]
    file.unlink()
    file.write_text(json.dumps(sample))
    with pytest.raises(InputError, match=r"pose_03.data\.json: has no 'O_T_EE'"):
        franka_charuco.load(tmp_path / "copy")
