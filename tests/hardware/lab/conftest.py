"""One scene and one eye for all tests of the lab; skipped where nothing can be drawn."""

import numpy as np
import pytest
from hecbench_hardware.lab import cells


@pytest.fixture(scope="session")
def station():
    return cells.ur5e()


@pytest.fixture(scope="session")
def lab_scene(station):
    pytest.importorskip("mujoco", reason="the lab needs mujoco: pip install 'hecbench[lab]'")
    return station.scene(flange_tag=station.flange_tag(0), workpiece=True)


@pytest.fixture
def eye_of(drawable, lab_scene):
    """Opens eyes on the scene and closes them."""
    from hecbench_hardware.lab.eye import Eye, Sensor

    opened = []

    def open_eye(camera, supersample=2, noise=0.0, **settings):
        opened.append(Eye(lab_scene, camera, Sensor(supersample, noise), **settings))
        return opened[-1]

    yield open_eye
    for eye in opened:
        eye.close()


@pytest.fixture
def near_view(station):
    """base_T_workpiece and base_T_camera (4, 4) with the tag 0.8 m away, somewhat from the side."""
    base_T_workpiece = station.workpiece_pose(0)
    tag = base_T_workpiece[:3, 3] + [0, 0, 0.065]
    aside = station.base_T_room[:3, :3] @ np.array([0.65, 0.2, 0.42])
    return base_T_workpiece, cells.looking_at(tag + aside, tag)
