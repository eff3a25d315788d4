"""Faults in the middle of a motion: a named state, one line, the arm at rest, and back to work."""

import os
import signal
import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from hecbench_hardware.devices import DeviceFault, Fault

pytest.importorskip("rtde_receive", reason="ur-rtde has no wheel for this Python")

SLOW_RAD_S = 0.002
"""Twenty seconds for two radians at the controller's pace, unless a fault ends it; more than what counts as still."""


def moved_into(robot, act, speed_rad_s=SLOW_RAD_S):
    """The fault that ends a motion during which `act` happens."""

    def act_while_moving():
        while not np.abs(robot.state().joint_speeds_rad_s).max() > 0:
            time.sleep(0.005)
        act()

    actor = threading.Thread(target=act_while_moving)
    actor.start()
    with pytest.raises(DeviceFault) as caught:
        robot.move_joints(robot.state().joints_rad + 2 * np.eye(6)[0], speed_rad_s=speed_rad_s)
    actor.join()
    assert "\n" not in str(caught.value)
    return caught.value.fault


@pytest.mark.parametrize(
    ("verb", "fault"),
    [
        ("protective_stop", Fault.PROTECTIVE_STOP),
        ("emergency_stop", Fault.EMERGENCY_STOP),
        ("link_loss 0.2", Fault.LINK_LOST),
        ("local_mode", Fault.LOCAL_MODE),
        ("stale", Fault.STALE),
        ("slow 0.001", Fault.LATE),
        ("push 120", Fault.FORCE),
        ("contact 0.6", Fault.PROTECTIVE_STOP),
        ("end_program", Fault.PROGRAM_ENDED),
    ],
)
def test_fault_in_motion_is_named_and_recovered_from(connect, patient, controller, ready_pose, verb, fault):
    slowed = verb.startswith("slow")
    robot = connect(supervision=replace(patient, late_s=5.0 if slowed else patient.late_s))
    robot.enable()
    seen = moved_into(robot, lambda: controller.fault(verb), 0.05 if slowed else SLOW_RAD_S)
    assert seen is fault or (verb.startswith("contact") and seen is Fault.FORCE)
    if fault is not Fault.PROTECTIVE_STOP:
        controller.fault("reset")
    else:
        controller.fault("contact -9")
    asked = []
    assert robot.recover(lambda line: not asked.append(line))
    assert len(asked) == 1
    robot.move_joints(ready_pose)
    assert np.abs(robot.settle().joints_rad - ready_pose).max() < 1e-9


def test_a_straight_line_into_the_unreachable(robot, controller):
    controller.fault("unreachable")
    target = robot.state().base_T_flange.copy()
    target[2, 3] += 0.05
    with pytest.raises(DeviceFault) as caught:
        robot.move_linear(target)
    assert caught.value.fault is Fault.PROGRAM_ENDED


def test_the_operator_may_refuse(robot, controller, ready_pose):
    assert moved_into(robot, lambda: controller.fault("protective_stop")) is Fault.PROTECTIVE_STOP
    assert not robot.recover(lambda line: False)
    with pytest.raises(DeviceFault) as caught:
        robot.move_joints(ready_pose)
    assert caught.value.fault is Fault.PROTECTIVE_STOP
    assert robot.state().joints_rad.shape == (6,)


def test_emergency_stop_must_be_released_first(robot, controller, monkeypatch):
    monkeypatch.setattr("hecbench_hardware.ur.recovery._RELEASE_S", 0.2)
    assert moved_into(robot, lambda: controller.fault("emergency_stop")) is Fault.EMERGENCY_STOP
    with pytest.raises(DeviceFault, match="still pressed"):
        robot.recover(lambda line: True)
    with pytest.raises(DeviceFault):
        robot.state()
    controller.fault("release_emergency_stop")
    assert robot.recover(lambda line: True)


@pytest.mark.parametrize("role", ["control", "stream"])
def test_a_dead_worker_is_a_lost_link_and_stops_the_arm(robot, connect, role):
    watcher = connect()
    worker = robot._control.worker if role == "control" else robot._stream
    assert moved_into(robot, lambda: os.kill(worker.pid, signal.SIGKILL)) is Fault.LINK_LOST
    assert np.abs(watcher.settle(30.0).joint_speeds_rad_s).max() == 0


def test_a_hanging_client_is_ended_and_the_arm_stopped(connect, patient):
    """A stopped process answers as little as a library that hangs with the interpreter held."""
    watcher, robot = connect(), connect(supervision=replace(patient, leniency=2.0))
    robot.enable()
    assert moved_into(robot, lambda: os.kill(robot._control.worker.pid, signal.SIGSTOP)) is Fault.LINK_LOST
    assert np.abs(watcher.settle(30.0).joint_speeds_rad_s).max() == 0
    assert robot.recover(lambda line: True)


def test_a_busy_reader_is_not_a_stale_stream(connect, monkeypatch):
    """As when this program holds the interpreter for a while: the samples wait, they are not missing."""
    robot = connect()
    take, pauses = robot._stream._take, [1.5]

    def take_late(sample):
        if pauses:
            time.sleep(pauses.pop())
        take(sample)

    monkeypatch.setattr(robot._stream, "_take", take_late)
    time.sleep(2.0)
    assert not pauses
    assert robot._stream.fault is None
    robot.settle()


def test_a_lost_link_while_reading(connect, controller):
    robot = connect()
    controller.fault("link_loss 0.1")

    def settle_again_and_again():
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline:  # the news may be on its way
            robot.settle()

    with pytest.raises(DeviceFault) as caught:
        settle_again_and_again()
    assert caught.value.fault is Fault.LINK_LOST
    with pytest.raises(DeviceFault):
        robot.state()
