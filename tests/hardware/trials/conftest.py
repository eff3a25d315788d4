"""A lab cell without pictures."""

import pytest
from hecbench_hardware.lab import cells
from hecbench_hardware.lab.arm import LabRobot
from hecbench_hardware.trials import calibrations


@pytest.fixture
def station():
    return cells.ur5e()


@pytest.fixture
def cell(station):
    pytest.importorskip("mujoco", reason="the contact sweep needs mujoco: pip install 'hecbench[lab]'")
    from hecbench_hardware.lab.trial_cell import LabCell

    robot = LabRobot(station)
    robot.enable()
    return LabCell(station, robot, None)


@pytest.fixture
def moved(station):
    """The first calibrations, each moved by so many millimetres."""

    def calibrated(offset_mm, count=2):
        return calibrations.moved_truth(count, station.camera_pose, offset_mm, seed=0)

    return calibrated
