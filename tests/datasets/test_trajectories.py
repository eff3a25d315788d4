"""Streams with clocks of their own: the simulated arm of ethz hand_eye_calibration, and generated ones."""

import numpy as np
import pytest
from hecbench_datasets.formats import trajectories

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import Mounting


def test_the_simulated_arm_reaches_the_reference(data, sniffers, spread):
    folder = data / "ethz_arm_sim"
    assert sniffers(folder) == ["trajectories"]
    recording = trajectories.load(folder)
    assert (len(recording), recording.mounting) == (150, Mounting.EYE_IN_HAND)
    assert spread(recording)[:2] == pytest.approx((0.21, 1.5), rel=0.1)
    assert spread(recording, "DANIILIDIS")[:2] == pytest.approx((2.66, 134), rel=0.05)
    assert "target_T_camera quat_xyzw in m" in recording.notes[0]


OFFSET_S = 0.137


@pytest.fixture
def streams(cell):
    """A smooth motion sampled by two clocks: robot rows and camera rows (t, x y z, qx qy qz qw)."""
    _, _, flange_T_camera = cell(True)
    world_T_target = se3.from_rotvec([0.1, 0.4, -0.2], [0.7, 0.0, 0.1])

    def world_T_camera(t):
        angles = np.stack([0.5 * np.sin(0.9 * t), 0.4 * np.sin(1.3 * t + 1), 0.6 * np.sin(0.7 * t)], -1)
        offsets = np.stack([0.2 * np.sin(0.8 * t), 0.2 * np.cos(t), 0.1 * np.sin(1.7 * t) - 0.9], -1)
        return world_T_target @ se3.from_rotvec(angles, offsets)

    robot_t, camera_t = np.arange(0, 20, 0.01), np.arange(1, 19, 1 / 30)
    robot = world_T_camera(robot_t) @ se3.inverse(flange_T_camera)
    camera = se3.inverse(world_T_target) @ world_T_camera(camera_t)

    def rows(t, poses, quaternion=se3.to_quat_xyzw):
        return np.hstack([t[:, None], poses[:, :3, 3], quaternion(poses)])

    return rows(robot_t, robot), rows(camera_t - OFFSET_S, camera), flange_T_camera


def test_the_clock_offset_is_found(tmp_path, streams, spread):
    robot, camera, truth = streams
    np.savetxt(tmp_path / "robot.csv", robot, delimiter=", ")
    np.savetxt(tmp_path / "camera.csv", camera, delimiter=", ", header="t, x, y, z, qx, qy, qz, qw")
    recording = trajectories.load(tmp_path)
    offset = (recording.robot_stamp_s - recording.camera_stamp_s)[0]
    assert offset == pytest.approx(OFFSET_S, abs=1e-3)
    assert 1e3 * se3.translation_error_m(spread(recording)[2], truth) < 0.5


def test_tum_with_nanoseconds_and_scalar_first_quaternions(tmp_path, streams, spread):
    robot, camera, truth = streams
    for name, rows in (("robot", robot), ("camera", camera)):
        stamps = ((rows[:, :1] + 1.7e9) * 1e9).astype(np.int64)
        swapped = np.hstack([rows[:, 1:4], rows[:, 7:], rows[:, 4:7]])
        lines = [
            f"{stamp} {' '.join(map(repr, row))}"
            for stamp, row in zip(stamps[:, 0], swapped.tolist(), strict=True)
        ]
        (tmp_path / f"{name}.tum").write_text("# stamp pose\n" + "\n".join(lines) + "\n")
    recording = trajectories.load(tmp_path)
    assert "base_T_flange quat_wxyz" in recording.notes[0]
    assert 1e3 * se3.translation_error_m(spread(recording)[2], truth) < 0.5


def test_the_offset_can_be_told(tmp_path, streams):
    robot, camera, _ = streams
    np.savetxt(tmp_path / "robot.csv", robot)
    np.savetxt(tmp_path / "camera.csv", camera)
    (tmp_path / "hecbench-import.yaml").write_text(f"time_offset_s: {OFFSET_S}\n")
    assert "as given" in trajectories.load(tmp_path).notes[1]


def test_streams_of_other_days_are_refused(tmp_path, streams):
    robot, camera, _ = streams
    camera[:, 0] += 1e5
    camera[:, 1:] = camera[0, 1:]
    np.savetxt(tmp_path / "robot.csv", robot)
    np.savetxt(tmp_path / "camera.csv", camera)
    with pytest.raises(InputError, match="do not overlap in time"):
        trajectories.load(tmp_path)


def test_a_stray_stamp_is_named(tmp_path, streams):
    robot, camera, _ = streams
    robot[0, 0] = -1.7e9
    np.savetxt(tmp_path / "robot.csv", robot)
    np.savetxt(tmp_path / "camera.csv", camera)
    with pytest.raises(InputError, match=r"robot\.csv: its stamps span 1\.7e\+09 s"):
        trajectories.load(tmp_path)


def test_an_unfinished_line_is_named(tmp_path, streams):
    robot, camera, _ = streams
    np.savetxt(tmp_path / "robot.csv", robot)
    np.savetxt(tmp_path / "camera.csv", camera)
    with (tmp_path / "camera.csv").open("a") as file:
        file.write("1.0 2.0\n")
    with pytest.raises(InputError, match=r"camera\.csv: line 541: 2 numbers after rows of 8"):
        trajectories.load(tmp_path)
