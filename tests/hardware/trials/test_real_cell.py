"""Trials without truth: the operator places the workpiece, gripper and arm say what came of it."""

import numpy as np
import pytest
from hecbench_hardware.devices import DeviceFault, Fault, Frame
from hecbench_hardware.lab import cells
from hecbench_hardware.lab.arm import LabGripper, LabRobot
from hecbench_hardware.trials import runner
from hecbench_hardware.trials.real_cell import RealCell
from hecbench_hardware.trials.runner import Plan
from hecbench_hardware.trials.tasks import Task

from hecbench import se3
from hecbench.storage.trial_record import Outcome


class Blind:
    name = "camera blind"

    def grab(self, timeout_s=2.0):
        model = cells.camera_model(320, 240)
        return Frame(np.full((model.height, model.width, 3), 120, np.uint8), 0.0, None, "grey")


@pytest.fixture
def table(station, monkeypatch):
    """A real cell made of the lab's arm and gripper; the tag's pose is given."""
    from hecbench_hardware.trials import solids

    robot = LabRobot(station)
    robot.enable()
    gripper = LabGripper("gripper x", 0.085, 0.040)
    real = RealCell(
        robot, gripper, Blind(), cells.camera_model(320, 240), station.gripper, places=2, ask=lambda line: True
    )  # fmt: skip
    camera_T_tag = se3.inverse(station.camera_pose(0)) @ station.workpiece_pose(0) @ solids.workpiece_T_tag()
    monkeypatch.setattr(real, "locate", lambda: camera_T_tag)
    return real


@pytest.mark.parametrize("holds", [True, False])
def test_grasp_is_what_the_gripper_still_holds(table, moved, tmp_path, holds):
    table.gripper.holds = lambda: holds
    trials = runner.run(Plan(Task.GRASP, moved(0.0, 1)), table, tmp_path).trials
    assert [trial.outcome is Outcome.SUCCESS for trial in trials] == [holds] * 2
    assert all(trial.margin_mm is None and trial.closed_form_success is None for trial in trials)
    assert holds or "holds nothing" in trials[0].reason


def test_insertion_succeeds_unless_the_arm_stops(table, moved, tmp_path, monkeypatch):
    assert (
        runner.run(Plan(Task.INSERTION, moved(0.0, 1)), table, tmp_path / "a").trials[0].outcome == "success"
    )

    move, calls = table.robot.move_linear, []

    def stop_on_the_way_down(pose):
        calls.append(pose)
        if len(calls) % 2:
            raise DeviceFault(Fault.FORCE, "robot x", "80 N")
        move(pose)

    monkeypatch.setattr(table.robot, "move_linear", stop_on_the_way_down)
    trials = runner.run(Plan(Task.INSERTION, moved(0.0, 1)), table, tmp_path / "b").trials
    assert {trial.outcome for trial in trials} == {Outcome.FAILURE}


def test_workpiece_that_is_not_placed_or_not_seen_gives_no_verdict(table, moved, tmp_path, monkeypatch):
    monkeypatch.setattr(table, "locate", lambda: RealCell.locate(table))
    contents = runner.run(Plan(Task.GRASP, moved(0.0, 1), most=1), table, tmp_path)
    assert contents.trials == []
    assert "not in the picture" in contents.aborted[0].reason
    monkeypatch.setattr(table, "_ask", lambda line: False)
    contents = runner.run(Plan(Task.GRASP, moved(0.0, 1), most=1), table, tmp_path, resume=True)
    assert "--resume" in contents.aborted[-1].reason
