"""Clients of other authors on the simulated controller, unmodified, each in a process of its own.

None of them is a dependency. Those that the interpreter lacks are skipped; another interpreter is named by the
environment variable HECBENCH_CLIENTS_PYTHON. Run: ``make bench TEST_ARGS=benchmarks/bench_robot_clients.py``.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from hecbench_hardware.controller_sim.process import SimulatedController
from hecbench_hardware.controller_sim.server import VERSION

PYTHON = os.environ.get("HECBENCH_CLIENTS_PYTHON", sys.executable)
CLIENTS = Path(__file__).parent / "robot_clients"
MODULES = {
    "ur_rtde_tests": "rtde_control",
    "ur_rtde_urcap": "rtde_control",
    "rtde_library": "rtde.rtde",
    "urx_robot": "urx",
    "urkit_robot": "urkit",
    "ur_remote_robot": "ur_remote",
    "ur_aj_functions": "ur_aj",
    "pyrobotiqur_gripper": "pyrobotiqur",
}
"""What each script imports first."""

VERSIONS = {"urx_robot": (3, 4, 5, 0)}
"""The controller's software where a client does not know the newer one: urx 0.11 stops at 3.4."""
REFUSED = {"ur_rtde_urcap"}
"""Whose operator presses play before the script is served."""


@pytest.mark.parametrize("name", sorted(MODULES))
def test_client(name):
    if subprocess.run([PYTHON, "-c", f"import {MODULES[name]}"], capture_output=True).returncode:
        pytest.skip(f"{MODULES[name]} is not installed")
    with SimulatedController(version=VERSIONS.get(name, VERSION)) as controller:
        command = [PYTHON, "-P", str(CLIENTS / f"{name}.py"), controller.host]
        ended = subprocess.run(command, capture_output=True, text=True, timeout=240)
        log = controller.ask("log")
    assert ended.returncode == 0, f"{ended.stderr[-2000:]}\n{log}"
    assert name in REFUSED or "program error" not in log
