"""A controller without the mark of the simulated one is taken for a real arm: nothing moves that nobody allowed.

The mark is the end of the version's text; `unmarked` takes it away.
"""

import threading
import time

import numpy as np
import pytest
from click.testing import CliRunner
from hecbench_hardware import arming
from hecbench_hardware.arming import MOST_FAULTS, Operator
from hecbench_hardware.commands import record
from hecbench_hardware.kinematics import ARMS
from hecbench_hardware.lab import cells
from hecbench_hardware.trial_commands import trial

from hecbench.estimate import Estimate
from hecbench.recording import Mounting, Recording, RobotDescription
from hecbench.storage import recording_io

pytest.importorskip("rtde_receive", reason="ur-rtde has no wheel for this Python")

MADE_READY = ("motion", "unlock", "power on", "brake release")


@pytest.fixture
def real(controller):
    controller.fault("unmarked")
    return controller


@pytest.fixture
def cell(tmp_path, ready_pose):
    joints = ready_pose + 0.3 * np.eye(6)[:3]
    description = Recording(
        name="cell",
        mounting=Mounting.EYE_IN_HAND,
        sample_ids=("0", "1", "2"),
        robot=RobotDescription(model="ur5e"),
        joints_rad=joints,
        base_T_flange=ARMS["ur5e"].forward(joints),
    )
    recording_io.save(description, tmp_path / "cell")
    return tmp_path / "cell"


def run(verb, *words):
    return CliRunner().invoke(verb, [str(word) for word in words])


def while_moving(controller, *verbs):
    """Starts a thread that injects faults once the arm moves."""

    def inject():
        deadline = time.monotonic() + 60
        while float(controller.ask("speed")) == 0:
            assert time.monotonic() < deadline
            time.sleep(0.005)
        for verb in verbs:
            controller.fault(verb)
            time.sleep(0.3)

    thread = threading.Thread(target=inject)
    thread.start()
    return thread


@pytest.mark.parametrize(
    "verbs",
    [
        ("protective_stop",),
        ("emergency_stop", "release_emergency_stop"),
        ("push 120", "push 0"),
        ("local_mode",),
        ("end_program",),
        ("link_loss 0.2",),
        ("slow 0.001",),
    ],
    ids=lambda verbs: verbs[0].split()[0],
)
def test_yes_does_not_answer_for_a_person_after_a_fault(real, cell, tmp_path, verbs):
    actor = while_moving(real, *verbs)
    result = run(
        record, cell, "--out", tmp_path / "out", "--robot", "ur5e", "--host", real.host, "--arm", "--yes",
        "--set", "robot.max_age_s=1", "--set", "robot.leniency=10",
    )  # fmt: skip
    actor.join()
    assert result.exit_code == 1, result.output
    time.sleep(0.2)
    events = real.ask("log").split(" | ")
    last = max(i for i, event in enumerate(events) if "injected: " + verbs[0] in event)
    assert any("motion" in event for event in events[:last])
    assert not [event for event in events[last:] if any(word in event for word in MADE_READY)]
    assert float(real.ask("speed")) == 0


class Someone:
    """A person at the terminal who says yes."""

    def isatty(self):
        return True


@pytest.fixture
def person(monkeypatch):
    asked = []
    monkeypatch.setattr(arming.sys, "stdin", Someone())
    monkeypatch.setattr(arming.click, "confirm", lambda line, err: not asked.append(line))
    return asked


class Arm:
    def __init__(self, simulated):
        self.simulated = simulated


def test_a_person_acknowledges_only_so_many_faults(person):
    operator = Operator(Arm(simulated=False), yes=True)
    assert [operator.acknowledge("fault") for _ in range(MOST_FAULTS + 2)] == [True] * MOST_FAULTS + [
        False
    ] * 2
    assert len(person) == MOST_FAULTS


def test_hands_out_of_the_cell_is_for_a_person_to_say(person):
    assert Operator(Arm(simulated=False), yes=True).ask("Is the workpiece there?")
    assert person == ["Is the workpiece there?"]
    assert Operator(Arm(simulated=True), yes=True).ask("Is the workpiece there?")
    assert len(person) == 1


def test_nobody_is_asked_about_a_simulated_arm(person):
    assert all(Operator(Arm(simulated=True)).acknowledge("fault") for _ in range(2 * MOST_FAULTS))
    assert not person


@pytest.mark.parametrize("leave", [(), ("--arm",)], ids=["not armed", "not confirmed"])
def test_fingers_stand_still_until_the_arm_may_move(real, registers, tmp_path, leave):
    station = cells.ur5e()
    estimate = Estimate(
        station.camera_pose(0), solver="mine", recording="x", camera=cells.camera_model(), parent_link="base"
    )
    estimate.save(tmp_path / "e.json")
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    (pictures / "0.png").touch()
    before = registers()
    result = run(
        trial, "grasp", "--robot", "ur5e", "--host", real.host, "--gripper", "robotiq", "--camera", "images",
        "--set", f"camera.folder={pictures}", "--estimate", tmp_path / "e.json", "--out", tmp_path / "out", *leave,
    )  # fmt: skip
    assert result.exit_code != 0
    assert leave or "--arm" in str(result.exception)
    assert registers() == before
    assert not [event for event in real.ask("log").split(" | ") if "motion" in event]
