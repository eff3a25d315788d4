"""The 42 real pairs of handeye_calib_camodocal, and OpenCV's own names."""

import numpy as np
import pytest
from hecbench_datasets.formats import opencv_yaml

from hecbench.errors import InputError
from hecbench.recording import Mounting


def write(path, families):
    lines = ["%YAML:1.0", "---"]
    for name, poses in families.items():
        for i, pose in enumerate(poses):
            values = ", ".join(map(repr, np.ravel(pose).tolist()))
            lines += [
                f"{name}_{i}: !!opencv-matrix",
                "   rows: 4",
                "   cols: 4",
                "   dt: d",
                f"   data: [ {values} ]",
            ]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_real_pairs_reach_the_reference(data, sniffers, spread):
    assert sniffers(data / "camodocal_ur") == ["opencv_yaml"]
    recording = opencv_yaml.load(data / "camodocal_ur")
    assert (len(recording), recording.mounting) == (42, Mounting.EYE_TO_HAND)
    assert spread(recording)[:2] == pytest.approx((4.0, 6.8), rel=0.02)
    assert "eye_to_hand, base_T_flange matrix in m" in recording.notes[0]


@pytest.mark.parametrize("eye_in_hand", [True, False])
def test_the_names_of_opencv_say_the_direction(tmp_path, cell, eye_in_hand):
    from hecbench import se3

    robot, target, _ = cell(eye_in_hand)
    file = write(tmp_path / "pairs.yml", {"base2gripper": se3.inverse(robot), "target2cam": target})
    recording = opencv_yaml.load(file)
    assert recording.mounting is (Mounting.EYE_IN_HAND if eye_in_hand else Mounting.EYE_TO_HAND)
    np.testing.assert_allclose(recording.base_T_flange, robot, atol=1e-9)


def test_names_that_say_nothing_are_refused(tmp_path, cell):
    robot, target, _ = cell(True)
    file = write(tmp_path / "pairs.yml", {"a": robot, "b": target})
    with pytest.raises(InputError, match="its matrices are called a, b"):
        opencv_yaml.load(file)


def test_damaged_files_are_named(tmp_path):
    file = tmp_path / "pairs.yml"
    file.write_text("%YAML:1.0\nT1_0: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: d\n   data: [ 1, 2\n")
    with pytest.raises(InputError, match=r"pairs\.yml: is not readable YAML"):
        opencv_yaml.load(file)
    file.write_text("%YAML:1.0\nT1_0: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: d\n   data: [ 1, 2 ]\n")
    with pytest.raises(InputError, match=r"pairs\.yml: is not readable YAML"):
        opencv_yaml.load(file)
