"""easy_handeye's samples of ROS 1 and 2, which invert the robot for a fixed camera."""

import numpy as np
import pytest
import yaml
from hecbench_datasets.formats import easy_handeye

from hecbench import se3
from hecbench.errors import InputError
from hecbench.estimate import Estimate
from hecbench.exchange import export
from hecbench.recording import Mounting


def transform(pose):
    x, y, z = pose[:3, 3].tolist()
    names = dict(zip("xyzw", se3.to_quat_xyzw(pose).tolist(), strict=True))
    return {"translation": {"x": x, "y": y, "z": z}, "rotation": names}


@pytest.fixture(params=[True, False], ids=["on_hand", "on_base"])
def session(request, cell, tmp_path):
    """A folder with samples as easy_handeye stores them, and a calibration file as it publishes it."""
    robot, target, parent_T_camera = cell(request.param)
    mounting = Mounting.EYE_IN_HAND if request.param else Mounting.EYE_TO_HAND
    stored = robot if request.param else se3.inverse(robot)
    samples = [{"robot": transform(a), "tracking": transform(b)} for a, b in zip(stored, target, strict=True)]
    (tmp_path / "cell.samples").write_text(yaml.safe_dump({"samples": samples}))
    estimate = Estimate(
        parent_T_camera,
        solver="tsai",
        recording="cell",
        mounting=mounting,
        parent_link="tool0" if request.param else "base_link",
    )
    (tmp_path / "cell.yaml").write_text(export.easy_handeye(estimate, {}))
    return tmp_path, mounting, robot, target, parent_T_camera


def test_samples_with_their_calibration_file(session, sniffers):
    folder, mounting, robot, target, parent_T_camera = session
    assert sniffers(folder) == ["easy_handeye"]
    recording = easy_handeye.load(folder)
    assert recording.mounting is mounting
    np.testing.assert_allclose(recording.base_T_flange, robot, atol=1e-6)
    np.testing.assert_allclose(recording.camera_T_target, target, atol=1e-6)
    np.testing.assert_allclose(recording.initial_parent_T_camera, parent_T_camera, atol=1e-6)
    assert (recording.robot.base_link, recording.robot.flange_link) == ("base_link", "tool0")


def test_a_sample_list_dumped_from_the_service(session):
    folder, mounting, robot, target, _ = session
    stored = robot if mounting is Mounting.EYE_IN_HAND else se3.inverse(robot)
    lists = {
        "hand_world_samples": {"transforms": [transform(pose) for pose in stored]},
        "camera_marker_samples": {"transforms": [transform(pose) for pose in target]},
    }
    (folder / "cell.samples").write_text(yaml.safe_dump(lists))
    recording = easy_handeye.load(folder / "cell.samples")
    np.testing.assert_allclose(recording.base_T_flange, robot, atol=1e-6)


def test_without_the_calibration_file_the_mounting_is_asked_for(session):
    folder, mounting, robot, _, _ = session
    (folder / "cell.yaml").unlink()
    with pytest.raises(InputError, match="write 'mounting: eye_in_hand' or eye_to_hand into"):
        easy_handeye.load(folder)
    (folder / "hecbench-import.yaml").write_text(f"mounting: {mounting}\n")
    np.testing.assert_allclose(easy_handeye.load(folder).base_T_flange, robot, atol=1e-6)


def test_a_wrong_mounting_at_sampling_stays_ambiguous(session):
    folder, mounting, robot, target, _ = session
    given, other = ("true", "false") if mounting is Mounting.EYE_IN_HAND else ("false", "true")
    file = folder / "cell.yaml"
    file.write_text(file.read_text().replace(f"eye_on_hand: {given}", f"eye_on_hand: {other}"))
    stored = se3.inverse(robot) if mounting is Mounting.EYE_IN_HAND else robot
    samples = [{"robot": transform(a), "tracking": transform(b)} for a, b in zip(stored, target, strict=True)]
    (folder / "cell.samples").write_text(yaml.safe_dump({"samples": samples}))
    with pytest.raises(InputError, match="readings hold the target equally still") as caught:
        easy_handeye.load(folder)
    assert f"{mounting}, " in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("- robot:", "- tool:", "has no 'robot'"),
        ("translation:", "trans:", "has no 'translation'"),
        ("x: ", "x: .nan  # ", "not finite"),
        ("samples:", "samples: [", "is not readable YAML"),
    ],
)
def test_faults_name_the_file(session, old, new, message):
    file = session[0] / "cell.samples"
    file.write_text("# robot:\n" + file.read_text().replace(old, new))
    with pytest.raises(InputError, match=message) as caught:
        easy_handeye.load(file)
    assert "cell.samples" in str(caught.value)
