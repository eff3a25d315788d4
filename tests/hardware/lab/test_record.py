"""`hecbench record` in the lab: the lab's own arm, and a digital twin of one behind the real driver."""

import numpy as np
import pytest
from click.testing import CliRunner
from hecbench_hardware.commands import record
from hecbench_hardware.lab import cells

from hecbench import se3
from hecbench.recording import Mounting, Recording, RobotDescription
from hecbench.robots.model import load_robot
from hecbench.storage import recording_io


@pytest.fixture
def plan(station, tmp_path):
    joints = station.configuration_rad(0) + np.array([[0, 0, 0, 0, 0, 0], [0.1, -0.1, 0.1, 0.2, -0.1, 0.2]])
    camera = cells.camera_model(320, 240)
    recording_io.save(
        Recording(
            name="plan",
            mounting=Mounting.EYE_TO_HAND,
            sample_ids=("a", "b"),
            robot=RobotDescription(model="ur5e", joint_names=station.joint_names),
            camera=camera,
            target=station.flange_tag(0).target,
            joints_rad=joints,
            base_T_flange=station.arm.forward(joints),
            initial_parent_T_camera=se3.make(
                station.camera_pose(0)[:3, :3], station.camera_pose(0)[:3, 3] * 0.7
            ),
        ),
        tmp_path / "plan",
    )
    return tmp_path / "plan"


@pytest.mark.parametrize("robot", ["lab", "sim_ur5e"])
def test_recording_has_masks_truth_and_the_tag(drawable, plan, tmp_path, robot):
    if robot != "lab":
        pytest.importorskip("rtde_control", reason="the driver needs ur-rtde: pip install 'hecbench[ur]'")
    fast = [] if robot == "lab" else ["--set", "robot.time_scale=20", "--set", "robot.max_age_s=2"]
    arguments = [plan, "--out", tmp_path / "out", "--robot", robot, *fast, "--yes"]
    arguments += ["--camera", "lab", "--set", f"camera.cell={plan}"]
    result = CliRunner().invoke(record, [*map(str, arguments)], catch_exceptions=False)
    assert result.exit_code in (0, 3), result.output
    recording = recording_io.load(tmp_path / "out")
    assert recording.truth_parent_T_camera == pytest.approx(recording_io.load(plan).initial_parent_T_camera)
    assert all(recording.mask(i).any() and recording.image(i).any() for i in range(2))
    model = load_robot("ur5e", meshes=False)
    expected = model.forward(recording.joints_rad, base="base", tip="tool0")
    assert recording.base_T_flange == pytest.approx(expected, abs=1e-6)
