"""A program that stands still, as a whole or only its supervision, does not let the arm go on."""

import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace

import numpy as np
import psutil
import pytest
from hecbench_hardware.devices import DeviceFault, Fault
from hecbench_hardware.ur.dashboard import Dashboard
from hecbench_hardware.ur.stream import Supervision
from hecbench_hardware.ur.worker import WATCHDOG_HZ

pytest.importorskip("rtde_receive", reason="ur-rtde has no wheel for this Python")

AGE_S = 0.9
BOUND_S = Supervision(max_age_s=AGE_S).patience_s + 1 / WATCHDOG_HZ
"""Without braking. The motions here last many times longer."""
BUSY_S = 5.0
"""For a test machine that is busy with other things."""

PROGRAM = """
import sys, time
from hecbench_hardware.devices import DeviceFault
from hecbench_hardware.kinematics import ARMS
from hecbench_hardware.ur.robot import UrRobot
from hecbench_hardware.ur.stream import Supervision
host, what, age_s = sys.argv[1:]
with UrRobot(host, ARMS["ur5e"], supervision=Supervision(max_age_s=float(age_s), late_s=30, leniency=10)) as robot:
    robot.enable()
    here = robot.settle()
    target = here.base_T_flange.copy()
    target[2, 3] -= 0.3
    try:
        if what == "rest":
            print("ready", flush=True)
            sys.stdin.readline()
            robot.move_joints(here.joints_rad + 0.1)
            print("arrived", flush=True)
        else:
            print("ready", flush=True)
            if what == "joints":
                robot.move_joints(here.joints_rad + [2, 0, 0, 0, 0, 0], speed_rad_s=0.0004)
            elif what == "line":
                robot.move_linear(target, speed_m_s=0.0001)
            else:
                with robot.freedrive():
                    time.sleep(60)
    except DeviceFault as fault:
        print(fault, flush=True)
"""


@pytest.fixture
def program(controller):
    """Starts a program of its own on a controller that is taken for a real one; returns it when it is ready."""
    controller.fault("unmarked")
    started = []

    def start(what):
        command = [sys.executable, "-c", PROGRAM, controller.host, what, str(AGE_S)]
        started.append(subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True))
        assert started[-1].stdout.readline() == "ready\n"
        return started[-1]

    yield start
    for process in started:
        clients = clients_of(process) if process.poll() is None else []
        process.send_signal(signal.SIGCONT)
        process.kill()
        process.communicate()
        assert not psutil.wait_procs(clients, 30)[1]


def until(condition, timeout_s):
    """Seconds until a condition holds."""
    begun = time.monotonic()
    while not condition():
        assert time.monotonic() - begun < timeout_s, "it did not happen in time"
        time.sleep(0.01)
    return time.monotonic() - begun


def clients_of(process):
    """The processes in which a program's clients of the controller live."""
    return psutil.Process(process.pid).children()


def is_playing(controller):
    return "true" in Dashboard(controller.host).ask("running")


@pytest.mark.parametrize("what", ["joints", "line"])
def test_a_frozen_program_stops_its_motion(program, controller, what):
    moving = program(what)
    until(lambda: float(controller.ask("speed")) > 0, 30)
    time.sleep(0.3)
    assert float(controller.ask("speed")) > 0
    os.kill(moving.pid, signal.SIGSTOP)
    until(lambda: float(controller.ask("speed")) == 0, BOUND_S + BUSY_S)
    until(lambda: not is_playing(controller), BUSY_S)
    os.kill(moving.pid, signal.SIGCONT)
    assert "stale" in moving.stdout.readline()


def test_a_frozen_program_ends_freedrive(program, controller):
    guided = program("freedrive")
    until(lambda: is_playing(controller), 30)
    time.sleep(0.3)
    os.kill(guided.pid, signal.SIGSTOP)
    until(lambda: not is_playing(controller), BOUND_S + BUSY_S)


def test_the_watchdog_alone_stops_the_arm_of_a_frozen_client(program, controller):
    """Program and client are frozen together, as when the computer hangs."""
    moving = program("joints")
    until(lambda: float(controller.ask("speed")) > 0, 30)
    clients = clients_of(moving)
    for process in (moving, *clients):
        process.send_signal(signal.SIGSTOP)
    until(lambda: float(controller.ask("speed")) == 0, 1 / WATCHDOG_HZ + BUSY_S)
    assert "watchdog" in controller.ask("log")
    for client in clients:
        client.kill()


def test_at_rest_a_program_may_be_busy(program, controller):
    resting = program("rest")
    os.kill(resting.pid, signal.SIGSTOP)
    time.sleep(1.1 * BOUND_S)
    assert is_playing(controller)
    os.kill(resting.pid, signal.SIGCONT)
    resting.stdin.write("\n")
    resting.stdin.flush()
    assert resting.stdout.readline() == "arrived\n"


def test_supervision_that_hangs_stops_the_motion(connect, patient, controller, monkeypatch):
    """The thread that judges states hangs; the one that polls the motion does not."""
    controller.fault("unmarked")
    robot = connect(supervision=replace(patient, max_age_s=AGE_S))
    robot.enable()
    hang, take = threading.Event(), robot._stream._take
    monkeypatch.setattr(
        robot._stream, "_take", lambda sample: take(sample) if not hang.is_set() else time.sleep(0.1)
    )

    def hang_while_moving():
        until(lambda: float(controller.ask("speed")) > 0, 30)
        hang.set()

    threading.Thread(target=hang_while_moving).start()
    with pytest.raises(DeviceFault) as caught:
        robot.move_joints(robot.state().joints_rad + 2 * np.eye(6)[0], speed_rad_s=0.0004)
    assert caught.value.fault is Fault.STALE
    assert float(controller.ask("speed")) == 0
    with pytest.raises(DeviceFault):
        robot.move_joints(robot.state().joints_rad)


def test_only_motions_that_are_checked_can_be_started(robot):
    for method, name in (("start", "moveP"), ("call", "servoJ"), ("call", "moveJ"), ("call", "speedL")):
        with pytest.raises(Exception, match=f"{name} is not one of"):
            robot._control.request(method, name)
