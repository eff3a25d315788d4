"""ROS-Industrial's circle grid and its kinematic calibration."""

import numpy as np
import pytest
from hecbench_datasets.formats import industrial, industrial_kinematic

from hecbench.errors import InputError
from hecbench.recording import Mounting


def test_circle_grid_folder(data, sniffers):
    folder = data / "industrial_10x10" / "test_set_10x10"
    assert sniffers(folder) == ["industrial"]
    recording = industrial.load(folder)
    assert (len(recording), recording.mounting) == (15, Mounting.EYE_IN_HAND)
    assert recording.target.points_m.shape == (100, 3)
    np.testing.assert_allclose(np.diff(recording.target.points_m[:10, 0]), 0.0254)
    np.testing.assert_allclose(recording.camera.K, [[550, 0, 320], [0, 550, 240], [0, 0, 1]])
    assert [image.stem for image in recording.images] == list(recording.sample_ids)
    assert recording.initial_parent_T_camera is not None


def test_kinematic_calibration(data, sniffers):
    folder = data / "industrial_10x10" / "kinematic_calibration"
    assert sniffers(folder) == ["industrial_kinematic"]
    recording = industrial_kinematic.load(folder)
    assert recording.mounting is Mounting.EYE_TO_HAND
    assert recording.joints_rad.shape == (205, 2)
    assert recording.offers() == {"joints", "target_poses"}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("target_finder: {type: CircleGrid}\n", "has no 'data'"),
        ("target_finder: {type: CircleGrid}\ndata: []\n", "expected a list"),
        ("target_finder: {type: CircleGrid}\ndata: [{pose: a.yaml}]\n", "has no 'image'"),
        ("target_finder: [\n", "is not readable YAML"),
    ],
)
def test_faults_are_named(tmp_path, content, message):
    (tmp_path / "cal_data.yaml").write_text(content)
    with pytest.raises(InputError, match=message) as caught:
        industrial.load(tmp_path)
    assert "cal_data.yaml" in str(caught.value)
