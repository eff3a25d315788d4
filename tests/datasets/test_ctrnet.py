"""CtRNet's Baxter picture."""

import numpy as np
import pytest
from hecbench_datasets.formats import ctrnet

from hecbench import se3
from hecbench.errors import InputError


def test_the_baxter_picture(data, sniffers):
    folder = data / "ctrnet_baxter"
    assert sniffers(folder) == ["ctrnet"]
    recording = ctrnet.load(folder)
    assert recording.sample_ids == ("baxter",)
    assert recording.robot.joint_names[0] == "left_s0"
    np.testing.assert_allclose(recording.joints_rad, [[0, 0, 0, 0, 0, 0, 1.8]])
    np.testing.assert_allclose(
        se3.inverse(recording.initial_parent_T_camera)[:3, 3], [-0.5949, 0.1592, 1.1780]
    )
    assert recording.image(0).shape == (1536, 2048, 3)


def test_a_readme_without_its_picture_is_refused(data, tmp_path):
    (tmp_path / "README.md").write_text((data / "ctrnet_baxter" / "README.md").read_text())
    assert not ctrnet.sniff(tmp_path)
    with pytest.raises(InputError, match="describes no picture"):
        ctrnet.load(tmp_path)
