"""The lab's cell with six samples, recorded once."""

from contextlib import ExitStack

import pytest

pytest.importorskip("mujoco", reason="the lab needs mujoco: pip install 'hecbench[lab]'")

SAMPLES = 6


@pytest.fixture(scope="session")
def open_session(drawable):
    """Opens sessions of the lab's cell and closes them."""
    from hecbench_hardware.cameras.lab import open_camera
    from hecbench_hardware.cockpit.session import Session
    from hecbench_hardware.lab import cells, recordings
    from hecbench_hardware.robots.lab import open_lab

    with ExitStack() as opened:

        def open_it(folder, robot=None, cell=None):
            camera = open_camera({"width": "816", "height": "683", "supersample": "2"})
            opened.callback(camera.close)
            lab = open_lab({"floor": "0"})
            lab.enable()
            camera.follow(lab)
            cell = cell or recordings.cell(cells.ur5e(), 0, camera.intrinsics())
            return Session(cell, robot or lab, camera, folder, driven=robot is None)

        yield open_it


@pytest.fixture(scope="session")
def recorded(open_session, tmp_path_factory):
    """A session that followed its own suggestions."""
    session = open_session(tmp_path_factory.mktemp("cockpit") / "recording")
    for _ in range(SAMPLES):
        session.robot.move_joints(session.suggest().joints_rad)
        session.take()
    return session
