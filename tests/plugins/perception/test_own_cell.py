"""Photographs of one's own cell among the training pictures."""

from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("safetensors")
pytest.importorskip("onnx")

from click.testing import CliRunner  # noqa: E402
from hecbench_plugins.perception import own_cell  # noqa: E402
from hecbench_plugins.perception.choice import installed_folder  # noqa: E402
from hecbench_plugins.perception.commands import train  # noqa: E402
from hecbench_plugins.perception.family import Family  # noqa: E402
from hecbench_plugins.perception.model import PerceptionModel  # noqa: E402
from hecbench_plugins.perception.own_cell import Cell, WithOwnCells  # noqa: E402
from hecbench_plugins.perception.pictures import PictureMaker  # noqa: E402
from hecbench_plugins.perception.plan import Plan  # noqa: E402
from hecbench_plugins.perception.training import Training  # noqa: E402

from hecbench import se3  # noqa: E402
from hecbench.errors import InputError  # noqa: E402
from hecbench.robots.posed import PosedRobot  # noqa: E402
from hecbench.storage import recording_io  # noqa: E402

LIT = "lit_ur5e_1_00"


@pytest.fixture(scope="module")
def family():
    return Family.of(["ur5e", "ur3e"])


@pytest.fixture(scope="module")
def cell(shared, family):
    return Cell.of(shared / "data" / LIT, family)


def test_the_robot_is_where_the_photographs_confirm_it(shared, cell):
    recording = recording_io.load(shared / "data" / LIT)
    posed = PosedRobot.of(recording)
    truth = se3.inverse(recording.truth_parent_T_camera) @ posed.link_poses(posed.joints_rad)
    assert cell.camera_T_link.shape == truth.shape
    assert np.linalg.norm((cell.camera_T_link - truth)[..., :3, 3], axis=-1).max() < 0.005


def test_examples_are_labelled_parts_of_the_photographs(family, cell):
    mixed, own = WithOwnCells(PictureMaker(family, 96, 3), [cell]), 0
    for _ in range(24):
        example = mixed.example()
        assert example.image.shape == (96, 96, 3)
        assert example.shares.shape == (48, 48, len(family.palette) + 1)
        if example.visible_known:
            continue
        own += 1
        robot = 255 - example.shares[..., 0].astype(int)
        assert robot.max() == 255
        u, v = np.rint(example.keypoints.T / 2).astype(int)
        inside = (u >= 0) & (u < 48) & (v >= 0) & (v < 48)
        assert inside.any()
        assert np.median(robot[v[inside], u[inside]]) > 127  # joints lie inside of the robot
    assert 2 <= own <= 12


def test_a_photograph_that_the_robot_is_behind_is_left_out(shared, family, monkeypatch):
    truth = recording_io.load(shared / "data" / LIT).truth_parent_T_camera
    turned = truth @ np.diag([-1, 1, -1, 1.0]) @ se3.inverse(truth)
    whole = own_cell.undistorted_canvas

    def one_behind(recording, posed):
        canvas = whole(recording, posed)
        poses = canvas.parent_T_link.copy()
        poses[0] = turned @ poses[0]
        return replace(canvas, parent_T_link=poses)

    monkeypatch.setattr(own_cell, "undistorted_canvas", one_behind)
    cell = Cell.of(shared / "data" / LIT, family)
    assert len(cell.canvas) == len(cell.camera_T_link) == 4
    mixed = WithOwnCells(PictureMaker(family, 96, 3), [cell])
    assert all(mixed.example().image.shape == (96, 96, 3) for _ in range(12))


def test_a_recording_that_teaches_nothing_is_refused(shared, family, tmp_path):
    recording = recording_io.load(shared / "data" / LIT)
    noise = np.random.default_rng(0).integers(0, 255, (480, 640, 3)).astype(np.uint8)
    path = tmp_path / "noise"
    recording_io.save(replace(recording, images=(noise,) * len(recording), masks=None), path)
    with pytest.raises(
        InputError, match="noise: nothing can be learned from it, for render_gn finds no camera"
    ):
        Cell.of(path, family)
    with pytest.raises(InputError, match="its robot is ur5e, the network is for ur3e: add --robot ur5e"):
        Cell.of(shared / "data" / LIT, Family.of(["ur3e"]))
    result = CliRunner().invoke(
        train,
        ["perception", "--robot", "ur5e", "--out", str(tmp_path / "run"), "--adapt", str(tmp_path / "none")],
    )
    assert isinstance(result.exception, InputError)
    assert "does not exist" in str(result.exception)


def test_a_run_starts_from_an_installed_network_and_goes_on_with_ones_own_cell(shared, tmp_path):
    folder = installed_folder("ur")
    assert installed_folder("nothing") is None
    plan = Plan(
        ("ur5e", "ur3e"),
        tmp_path,
        1.0,
        steps=2,
        size=96,
        batch=4,
        capacity=8,
        start_from=folder,
        adapt=(shared / "data" / LIT,),
    )
    training = Training(plan, lambda line: None)
    assert training.progress.history[0].endswith(f"seed 0, started from weights_ur, adapted to {LIT}")
    image = recording_io.load(shared / "data" / LIT).image(0)[::2, ::2][:224, :320]
    x = torch.from_numpy(image.copy()).permute(2, 0, 1)[None].float() / 255
    with torch.no_grad():
        ours = training.averaged_network().eval()(x).numpy()[0]
    theirs = PerceptionModel(folder)._answer(image)
    robot, expected = ours[0] < np.logaddexp.reduce(ours[1:5]), theirs[0] < np.logaddexp.reduce(theirs[1:5])
    assert (robot & expected).sum() > 0.9 * (robot | expected).sum()
    training.run()
    assert training.progress.step == 2
