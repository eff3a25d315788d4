"""The driver against ur_rtde called directly, on one simulated controller in real time: cost per command.

Rounds alternate between the two, so that a busy machine slows both. Run:
``.venv/bin/python benchmarks/bench_robot_overhead.py [ROUNDS]``.
"""

import sys
import time

import numpy as np
import rtde_control
import rtde_receive
from hecbench_hardware.controller_sim.process import SimulatedController
from hecbench_hardware.kinematics import ARMS
from hecbench_hardware.ur.robot import UrRobot
from hecbench_hardware.ur.stream import Supervision

HOME = [0.0, -1.5707963, 1.5707963, -1.5707963, -1.5707963, 0.0]


def direct_move(client):
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


def stream_rate_hz(host, duration_s=2.0):
    """Samples with a new controller clock per second at 500 Hz."""
    client, stamps = rtde_receive.RTDEReceiveInterface(host, 500.0), set()
    began = time.perf_counter()
    while time.perf_counter() - began < duration_s:
        stamps.add(client.getTimestamp())
        time.sleep(2e-4)
    client.disconnect()
    return len(stamps) / duration_s


def main(rounds=300):
    with SimulatedController() as one, SimulatedController() as other:
        print(f"stream: {stream_rate_hz(one.host):.0f} Hz of 500 Hz")
        client = rtde_control.RTDEControlInterface(one.host)
        robot = UrRobot(other.host, ARMS["ur5e"], supervision=Supervision(max_age_s=2.0))
        robot.enable()
        client.moveJ(HOME)
        robot.move_joints(HOME)
        pairs = {
            "question (getTCPOffset)": (client.getTCPOffset, lambda: robot._request("call", "getTCPOffset")),
            "motion of length 0": (lambda: direct_move(client), lambda: robot.move_joints(HOME)),
        }
        for name, (direct, driven) in pairs.items():
            times_ms = 1e3 * np.array([(seconds(direct), seconds(driven)) for _ in range(rounds)])
            plain, ours = np.median(times_ms, axis=0)
            low, high = np.percentile(times_ms[:, 1] - times_ms[:, 0], (25, 75))
            print(
                f"{name}: direct {plain:.2f} ms, driver {ours:.2f} ms, median overhead {ours - plain:.2f} ms"
            )
            print(f"  quartiles of the paired difference: {low:.2f} to {high:.2f} ms")
        state_us = 1e6 * np.median([seconds(robot.state) for _ in range(rounds)])
        print(f"state(): {state_us:.0f} us")
        robot.close()
        client.disconnect()


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
