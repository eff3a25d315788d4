"""Recordings to examine."""

import numpy as np
import pytest
from hecbench_datasets.suites.synthetic_markers import make
from hecbench_datasets.synthetic_faults import FAULTS, arm_recording

from hecbench import preparation
from hecbench.diagnose import check
from hecbench.robots.model import load_robot


@pytest.fixture(scope="session")
def robot():
    return load_robot("ur5e", meshes=False)


@pytest.fixture(scope="session")
def good(robot):
    """A good recording by kind and number."""

    def recording(kind, index):
        if kind == "arm":
            return arm_recording(robot, np.random.default_rng([7, index]))
        return make(kind, index, 3)

    return recording


@pytest.fixture(scope="session")
def faulty(good):
    """A recording with one seeded fault."""

    def recording(name, kind, index):
        fault = FAULTS[name]
        source = good(kind, index)
        if fault.needs_target_poses:
            source = preparation.prepare(source)
        return fault.seed(source, np.random.default_rng([11, index]))

    return recording


@pytest.fixture(scope="session")
def found():
    """Findings of a recording by id."""
    return lambda recording: {finding.id: finding for finding in check(recording)}
