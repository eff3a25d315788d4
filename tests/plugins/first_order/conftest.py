"""One scene of the suite `synthetic`, with a start near its truth."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_datasets.suites import synthetic

from hecbench import registry, se3
from hecbench.specs import Kind, SolverSpec


def _start_off(recording, phi_deg, rho_m):
    truth = se3.inverse(recording.truth_parent_T_camera)
    turn = se3.so3_exp(np.deg2rad(phi_deg)) @ truth[:3, :3]
    start = se3.make(turn, truth[:3, 3] + rho_m)
    return replace(recording, initial_parent_T_camera=se3.inverse(start))


@pytest.fixture(scope="session")
def start_off():
    """Puts a recording's start off by a turn about the base's origin and a shift, both in the camera's axes."""
    return _start_off


@pytest.fixture(scope="session")
def error_of():
    """Translation mm and rotation rad by which an estimate's camera_T_base is off."""

    def error(estimate, recording):
        found, truth = se3.inverse(estimate.parent_T_camera), se3.inverse(recording.truth_parent_T_camera)
        return 1e3 * float(se3.translation_error_m(found, truth)), float(se3.rotation_error_rad(found, truth))

    return error


@pytest.fixture(scope="session")
def solve():
    """Runs a solver, named with its options."""

    def run(name, recording):
        solver = registry.load().get(Kind.SOLVER, name, SolverSpec).factory()
        return solver(recording.without_truth(), rng=np.random.default_rng(0))

    return run


@pytest.fixture(scope="session")
def exact():
    """An exact recording with the suite's own start, 93 mm off."""
    return synthetic.make("LP", 0, 0)


@pytest.fixture(scope="session")
def scene(exact):
    """The same, its start 30 mm and 2.4 degrees off."""
    return _start_off(exact, [1.0, -2.0, 1.0], [0.02, -0.02, 0.01])
