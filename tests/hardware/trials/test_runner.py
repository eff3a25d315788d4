"""Trials run to a verdict, survive faults and kills, and count each trial once."""

import os
import signal
import subprocess
import sys
import textwrap
import time

import numpy as np
import pytest
from hecbench_hardware.devices import DeviceFault, Fault
from hecbench_hardware.trials import runner
from hecbench_hardware.trials.calibrations import predicted
from hecbench_hardware.trials.cell import Calibration, NotSeen
from hecbench_hardware.trials.runner import Plan
from hecbench_hardware.trials.tasks import Task

from hecbench import registry, se3
from hecbench.errors import InputError
from hecbench.storage import trial_record
from hecbench.storage.trial_record import Outcome


@pytest.mark.parametrize("task", Task)
def test_true_calibration_always_succeeds(cell, moved, tmp_path, task):
    contents = runner.run(Plan(task, moved(0.0, 6)), cell, tmp_path)
    assert len(contents.trials) == 18
    assert all(trial.outcome is Outcome.SUCCESS and trial.closed_form_success for trial in contents.trials)
    assert all(trial.state == "done" and len(trial.seconds) == 4 for trial in contents.trials)


@pytest.mark.parametrize("offset_mm", [3.0, 10.0, 30.0])
def test_offset_calibration_succeeds_as_the_formula_predicts(cell, station, moved, tmp_path, offset_mm):
    chosen = moved(offset_mm, 6)
    for task in Task:
        trials = runner.run(Plan(task, chosen), cell, tmp_path / task).trials
        expected = [
            predicted(task, c, station.camera_pose(c.number), station.workpiece_pose(place), station.gripper)
            for c in chosen
            for place in range(3)
        ]
        assert [trial.outcome is Outcome.SUCCESS for trial in trials] == expected
        assert all(trial.object_error_mm == pytest.approx(offset_mm) for trial in trials)


def test_resume_adds_only_what_is_missing(cell, moved, tmp_path):
    plan = Plan(Task.GRASP, moved(0.0))
    runner.run(Plan(Task.GRASP, moved(0.0), most=2), cell, tmp_path)
    with pytest.raises(InputError, match="--resume"):
        runner.run(plan, cell, tmp_path)
    seen = []
    contents = runner.run(plan, cell, tmp_path, resume=True, report=seen.append)
    assert (len(seen), len(contents.trials)) == (4, 6)


def test_damaged_line_is_skipped_and_made_again(cell, moved, tmp_path):
    plan = Plan(Task.GRASP, moved(0.0, 1))
    runner.run(plan, cell, tmp_path)
    path = tmp_path / trial_record.FILE_NAME
    path.write_bytes(path.read_bytes()[:-20])
    assert len(trial_record.read(tmp_path).damage) == 1
    contents = runner.run(plan, cell, tmp_path, resume=True)
    assert len(contents.trials) == 3
    assert len({trial.key for trial in contents.trials}) == 3


def test_killed_program_loses_and_doubles_nothing(tmp_path):
    pytest.importorskip("mujoco", reason="the contact sweep needs mujoco: pip install 'hecbench[lab]'")
    script = textwrap.dedent("""
        import sys, pathlib
        from hecbench_hardware.lab import cells
        from hecbench_hardware.lab.arm import LabRobot
        from hecbench_hardware.lab.trial_cell import LabCell
        from hecbench_hardware.trials import calibrations, runner
        from hecbench_hardware.trials.tasks import Task
        station = cells.ur5e()
        robot = LabRobot(station); robot.enable()
        plan = runner.Plan(Task.GRASP, calibrations.moved_truth(18, station.camera_pose, 0.0, 0))
        runner.run(plan, LabCell(station, robot, None), pathlib.Path(sys.argv[1]), resume=True)
    """)
    path = tmp_path / trial_record.FILE_NAME
    counts = []
    for kill_at in (5, 23):
        process = subprocess.Popen([sys.executable, "-c", script, str(tmp_path)])
        while process.poll() is None and (not path.exists() or path.read_bytes().count(b"\n") < kill_at):
            time.sleep(0.002)
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        counts.append(len(trial_record.read(tmp_path).trials))
    subprocess.run([sys.executable, "-c", script, str(tmp_path)], check=True)
    contents = trial_record.read(tmp_path)
    assert 5 <= counts[0] <= counts[1] < 54
    assert len(contents.trials) == 54
    assert path.read_bytes().count(b"\n") - len(contents.damage) == 54
    assert contents.aborted == []


class Faulty:
    """A robot that fails at one motion, then works again when it is made ready."""

    def __init__(self, robot, motion, fault, times=1, recovers=True):
        self._robot, self._motion, self._fault = robot, motion, fault
        self._times, self._recovers, self._count = times, recovers, 0

    def __getattr__(self, name):
        return getattr(self._robot, name)

    def _maybe_fail(self):
        self._count += 1
        if self._count >= self._motion and self._times:
            self._times -= 1
            raise DeviceFault(self._fault, "robot x", "as the test wants")

    def move_joints(self, joints):
        self._maybe_fail()
        self._robot.move_joints(joints)

    def move_linear(self, pose):
        self._maybe_fail()
        self._robot.move_linear(pose)

    def recover(self, acknowledge):
        return self._recovers


@pytest.mark.parametrize(("motion", "state"), [(2, "approach"), (3, "act"), (4, "retreat")])
def test_protective_stop_is_a_failed_trial(cell, moved, tmp_path, motion, state):
    cell.robot = Faulty(cell.robot, motion, Fault.PROTECTIVE_STOP)
    contents = runner.run(Plan(Task.INSERTION, moved(0.0, 1)), cell, tmp_path)
    first = contents.trials[0]
    assert (first.outcome, first.state) == (Outcome.FAILURE, state)
    assert "protective stop" in first.reason
    assert [trial.outcome for trial in contents.trials[1:]] == [Outcome.SUCCESS] * 2


def test_lost_link_is_aborted_and_repeated(cell, moved, tmp_path):
    cell.robot = Faulty(cell.robot, 3, Fault.LINK_LOST)
    contents = runner.run(Plan(Task.GRASP, moved(0.0, 1)), cell, tmp_path)
    assert [trial.outcome for trial in contents.trials] == [Outcome.SUCCESS] * 3
    assert [(trial.outcome, trial.attempt) for trial in contents.aborted] == [(Outcome.ABORTED, 1)]
    assert contents.trials[0].attempt == 2


def test_fault_that_stays_stops_the_run_and_resume_goes_on(cell, moved, tmp_path):
    plan, healthy = Plan(Task.GRASP, moved(0.0)), cell.robot
    cell.robot = Faulty(cell.robot, 7, Fault.LINK_LOST, times=99, recovers=False)
    with pytest.raises(DeviceFault, match="--resume goes on"):
        runner.run(plan, cell, tmp_path)
    assert len(trial_record.read(tmp_path).trials) == 1
    cell.robot = healthy
    assert len(runner.run(plan, cell, tmp_path, resume=True).trials) == 6


@pytest.mark.parametrize("fault", [Fault.CAMERA, Fault.GRIPPER])
def test_failing_camera_or_gripper_ends_the_run_with_its_cure(cell, moved, tmp_path, monkeypatch, fault):
    def fail(*_):
        raise DeviceFault(fault, "device x", "gone")

    if fault is Fault.CAMERA:
        monkeypatch.setattr(cell, "locate", fail)
    else:
        monkeypatch.setattr(cell.gripper, "close_fingers", fail)
    with pytest.raises(DeviceFault, match="check its"):
        runner.run(Plan(Task.GRASP, moved(0.0, 1)), cell, tmp_path)
    (aborted,) = trial_record.read(tmp_path).aborted
    assert aborted.state == ("locate" if fault is Fault.CAMERA else "act")


def test_unseen_tag_is_tried_again_and_no_verdict_on_the_calibration(cell, moved, tmp_path, monkeypatch):
    def refuse():
        raise NotSeen("tag36h11 id 0 is not in the picture: uncover it")

    monkeypatch.setattr(cell, "locate", refuse)
    contents = runner.run(Plan(Task.GRASP, moved(0.0, 1), most=1), cell, tmp_path)
    assert contents.trials == []
    assert [trial.attempt for trial in contents.aborted] == [1, 2, 3]


def test_unreachable_workpiece_is_the_calibrations_failure(cell, station, tmp_path):
    far = se3.make(np.eye(3), [1.5, 0.0, 0.0]) @ station.camera_pose(0)
    below = se3.make(np.eye(3), [0.0, 0.0, -0.35]) @ station.camera_pose(0)
    wrong = [Calibration("0", name, 0, pose) for name, pose in (("far", far), ("below", below))]
    trials = runner.run(Plan(Task.GRASP, wrong), cell, tmp_path).trials
    assert {trial.outcome for trial in trials} == {Outcome.FAILURE}
    causes = ("out of reach", "leaves the workspace", "rad is outside")
    assert all(any(cause in trial.reason for cause in causes) for trial in trials), [t.reason for t in trials]


def test_place_outside_the_workspace_is_bad_input(station):
    with pytest.raises(InputError, match="0 to 2"):
        station.workpiece_pose(3)


def test_two_runs_cannot_write_to_one_folder(cell, moved, tmp_path):
    with (
        trial_record.writing(tmp_path, resume=False),
        pytest.raises(InputError, match="other trials are written here"),
    ):
        runner.run(Plan(Task.GRASP, moved(0.0)), cell, tmp_path, resume=True)


def test_observers_hear_of_every_trial_and_a_broken_one_is_named_once(cell, moved, tmp_path, monkeypatch):
    seen, warnings = [], []

    def broken(trial):
        raise RuntimeError("no printer\nat all")

    observers = {"broken": broken, "good": lambda trial: seen.append(trial.key)}
    monkeypatch.setattr(registry, "load", lambda: registry.Registry([], observers))
    contents = runner.run(Plan(Task.GRASP, moved(0.0, 1)), cell, tmp_path, warn=warnings.append)
    assert seen == [trial.key for trial in contents.trials]
    assert len(seen) == 3
    assert warnings == [
        "broken: its hecbench_trial_finished failed (RuntimeError: no printer) and is not called again"
    ]
