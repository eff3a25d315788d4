"""Recognising a format is exclusive on real data, and never raises."""

import pytest

NAMES = {
    "ur3e_cam1": ["native"],
    "ur3e_cam1/recording.json": ["native"],
    "camodocal_ur": ["opencv_yaml"],
    "ethz_arm_sim/robot_arm_w_color_camera_sim.zip": ["trajectories"],
    "easyhec_franka/franka_offline_example.zip": ["easyhec"],
    "visp_franka/data-eye-in-hand": ["visp"],
    "industrial_10x10/test_set_10x10": ["industrial"],
    "industrial_10x10/kinematic_calibration": ["industrial_kinematic"],
    "pupil_tags": [],
    "apriltag_photos": [],
    "robots": [],
    "": [],
}


@pytest.mark.parametrize("name", NAMES)
def test_at_most_one_format_claims_a_real_folder(data, sniffers, name):
    assert sniffers(data / name) == NAMES[name]


@pytest.mark.parametrize("suffix", ["", ".yaml", ".json", ".zip", ".csv", ".samples", ".xml"])
@pytest.mark.parametrize("content", [b"", b"\x00\xff\xfe" * 50, b"[[[{", b"PK\x03\x04 cut"])
def test_nothing_is_recognised_in_noise(tmp_path, sniffers, suffix, content):
    file = tmp_path / f"robot_camera{suffix}"
    file.write_bytes(content)
    assert sniffers(file) == []
    assert sniffers(tmp_path) == []
    assert sniffers(tmp_path / "missing") == []
