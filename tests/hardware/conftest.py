"""One simulated controller per test process, as new before every test, and the driver on it."""

import socket
import time

import numpy as np
import pytest
from hecbench_hardware.controller_sim.process import SimulatedController
from hecbench_hardware.grippers import robotiq
from hecbench_hardware.kinematics import ARMS
from hecbench_hardware.ur.robot import UrRobot
from hecbench_hardware.ur.stream import Supervision

from hecbench.errors import HecbenchError

PATIENT = Supervision(max_age_s=1.0, late_s=10.0, leniency=10.0)
"""A busy test machine delays the stream; a laboratory's does not."""


@pytest.fixture(scope="session")
def drawable():
    from hecbench_hardware.lab.gl import open_context

    try:
        open_context(16, 16).free()
    except HecbenchError as error:
        pytest.skip(str(error))


@pytest.fixture
def patient():
    return PATIENT


@pytest.fixture(scope="session")
def running_controller():
    with SimulatedController(time_scale=50.0) as controller:
        yield controller


@pytest.fixture
def controller(running_controller):
    running_controller.fault("reset")
    return running_controller


@pytest.fixture
def connect(controller):
    """Connects read-only robots to the controller and closes them at the end."""
    robots = []

    def connected(supervision=PATIENT, **settings):
        robots.append(UrRobot(controller.host, ARMS["ur5e"], supervision=supervision, **settings))
        return robots[-1]

    yield connected
    for robot in robots:
        robot.close()


@pytest.fixture
def robot(connect):
    enabled = connect()
    enabled.enable()
    return enabled


@pytest.fixture
def registers(controller):
    """Reads what the controller's Robotiq gripper was sent and where it is."""

    def read():
        found = {}
        with socket.create_connection((controller.host, robotiq.PORT)) as client:
            lines = client.makefile("rw", newline="\n")
            for name in ("ACT", "GTO", "PRE", "POS"):
                lines.write(f"GET {name}\n")
                lines.flush()
                found[name] = int(lines.readline().split()[1])
        return found

    return read


@pytest.fixture
def ready_pose():
    """Joints away from singularities, tool down."""
    return np.array([0.3, -1.4, 1.5, -1.6, -1.5, 0.2])


@pytest.fixture
def wait_until():
    """Waits for a condition, patient on a busy machine."""

    def wait(condition, timeout_s=20.0):
        deadline = time.monotonic() + timeout_s
        while not condition():
            assert time.monotonic() < deadline, "it did not happen in time"
            time.sleep(0.005)

    return wait
