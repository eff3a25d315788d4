"""The driver against ur_rtde called directly, on simulated controllers in real time: at most 1 ms per command.

The two take turns, so that a busy machine slows both alike. Run:
``make bench TEST_ARGS=benchmarks/bench_robot_overhead.py``.
"""

import time

import numpy as np
import pytest
import rtde_control
import rtde_receive
from hecbench_hardware.controller_sim.process import SimulatedController
from hecbench_hardware.kinematics import ARMS
from hecbench_hardware.ur.robot import UrRobot
from hecbench_hardware.ur.stream import Supervision

HOME = [0.0, -1.5707963, 1.5707963, -1.5707963, -1.5707963, 0.0]
ROUNDS = 500


@pytest.fixture(scope="module")
def client():
    with SimulatedController() as controller:
        direct = rtde_control.RTDEControlInterface(controller.host)
        direct.moveJ(HOME)
        yield direct
        direct.disconnect()


@pytest.fixture(scope="module")
def robot():
    with (
        SimulatedController() as controller,
        UrRobot(controller.host, ARMS["ur5e"], supervision=Supervision(max_age_s=2.0)) as driven,
    ):
        driven.enable()
        driven.move_joints(HOME)
        yield driven


def direct_move(client):
    """What the driver does, with nothing around it: start, then poll each millisecond."""
    before = client.getAsyncOperationProgressEx().operationId()
    client.moveJ(HOME, 0.5, 1.0, True)
    while True:
        status = client.getAsyncOperationProgressEx()
        if status.operationId() != before and not status.isAsyncOperationRunning():
            return
        time.sleep(0.001)


def seconds(action):
    began = time.perf_counter()
    action()
    return time.perf_counter() - began


@pytest.mark.parametrize("command", ["question", "motion"])
def test_overhead_per_command(benchmark, client, robot, command):
    direct, driven = {
        "question": (client.getTCPOffset, lambda: robot._control.request("call", "getTCPOffset")),
        "motion": (lambda: direct_move(client), lambda: robot.move_joints(HOME)),
    }[command]
    times_ms = []
    benchmark.pedantic(lambda: times_ms.append((seconds(direct), seconds(driven))), rounds=ROUNDS)
    alone_ms, with_driver_ms = 1e3 * np.median(times_ms, axis=0)
    print(f"\n{command}: direct {alone_ms:.2f} ms, driver {with_driver_ms:.2f} ms (medians of {ROUNDS})")
    assert with_driver_ms - alone_ms <= 1.0


def test_reading_the_state(benchmark, robot):
    benchmark(robot.state)


def test_stream_rate(benchmark):
    """Samples with a new controller clock per second; the controller offers 500."""
    stamps, duration_s = set(), 4.0

    def listen():
        end = time.perf_counter() + duration_s
        while time.perf_counter() < end:
            stamps.add(receive.getTimestamp())
            time.sleep(2e-4)

    with SimulatedController() as controller:
        receive = rtde_receive.RTDEReceiveInterface(controller.host, 500.0)
        benchmark.pedantic(listen, rounds=1)
        receive.disconnect()
    print(f"\nstream: {len(stamps) / duration_s:.0f} Hz")
