"""EasyHeC's ten Panda images, from the archive and unpacked."""

import shutil
import zipfile

import numpy as np
import pytest
from hecbench_datasets.formats import easyhec

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import Mounting


@pytest.fixture(scope="module")
def archive(data):
    return data / "easyhec_franka" / "franka_offline_example.zip"


def test_the_archive(archive, sniffers):
    assert sniffers(archive.parent) == ["easyhec"]
    recording = easyhec.load(archive)
    assert (len(recording), recording.mounting) == (10, Mounting.EYE_TO_HAND)
    assert recording.joints_rad.shape == (10, 7)
    assert (recording.camera.width, recording.camera.height) == (640, 480)
    assert 0.02 < recording.mask(0).mean() < 0.5
    assert recording.offers() >= {"images", "masks", "joints", "intrinsics"}


def test_unpacked_it_is_the_same_and_decodes_nothing(archive, tmp_path):
    with zipfile.ZipFile(archive) as content:
        content.extractall(tmp_path)
    unpacked = easyhec.load(tmp_path / "offline_example")
    packed = easyhec.load(archive)
    assert all(image.suffix == ".png" for image in unpacked.images)
    np.testing.assert_array_equal(unpacked.image(3), packed.image(3))
    np.testing.assert_array_equal(unpacked.joints_rad, packed.joints_rad)


def test_a_damaged_archive_is_not_recognised_and_a_missing_file_named(archive, tmp_path):
    (tmp_path / "x.zip").write_bytes(archive.read_bytes()[:5000])
    assert not easyhec.sniff(tmp_path)
    with pytest.raises(InputError, match=r"holds no K\.txt"):
        easyhec.load(tmp_path)
    shutil.rmtree(tmp_path)
    (tmp_path / "qpos").mkdir(parents=True)
    (tmp_path / "qpos" / "000000.txt").write_text("0\n0\nnonsense\n")
    (tmp_path / "K.txt").write_text("1 0 0\n0 1 0\n0 0 1\n")
    with pytest.raises(InputError, match=r"000000\.txt: line 3"):
        easyhec.load(tmp_path)


def test_truth_and_urdf_in_the_folder_are_taken(archive, tmp_path):
    with zipfile.ZipFile(archive) as content:
        content.extractall(tmp_path)
    folder = tmp_path / "offline_example"
    bare = easyhec.load(folder)
    assert bare.truth_parent_T_camera is None
    assert any("--urdf" in note for note in bare.notes)
    camera_T_base = se3.exp(np.array([0.1, 0.2, 0.3, 0.4, 0.5, 1.0]))
    np.savetxt(folder / "Tc_c2b.txt", camera_T_base)
    (folder / "panda.urdf").write_text('<robot name="panda"><link name="panda_link0"/></robot>')
    recording = easyhec.load(folder)
    np.testing.assert_allclose(recording.truth_parent_T_camera, se3.inverse(camera_T_base), atol=1e-9)
    assert recording.robot.urdf == folder / "panda.urdf"
    (folder / "other.urdf").write_text("<robot/>")
    assert easyhec.load(folder).robot.urdf is None
    (folder / "Tc_c2b.txt").write_text("1 2 3\n")
    with pytest.raises(InputError, match=r"Tc_c2b\.txt: expected numbers of shape"):
        easyhec.load(folder)
