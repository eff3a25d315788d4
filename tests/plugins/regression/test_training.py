"""Training at a toy's size: its parts are right, a stop changes nothing, and a solver runs what it leaves."""

import hashlib
from dataclasses import replace

import msgspec
import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("safetensors")
pytest.importorskip("onnx")
pytest.importorskip("pytorch_kinematics")

import cv2  # noqa: E402
from hecbench_plugins.networks.ur import WEIGHTS  # noqa: E402
from hecbench_plugins.perception import commands  # noqa: E402
from hecbench_plugins.perception.card import read_network, write_card  # noqa: E402
from hecbench_plugins.perception.family import Family  # noqa: E402
from hecbench_plugins.perception.network import PerceptionNet  # noqa: E402
from hecbench_plugins.perception.skeleton import keypoint_positions, keypoints_of  # noqa: E402
from hecbench_plugins.regression import training  # noqa: E402
from hecbench_plugins.regression.card import RegressionCard  # noqa: E402
from hecbench_plugins.regression.kinematics import Kinematics  # noqa: E402
from hecbench_plugins.regression.losses import losses  # noqa: E402
from hecbench_plugins.regression.network import Dense, axis_of, places_of  # noqa: E402
from hecbench_plugins.regression.onnx_export import to_onnx  # noqa: E402
from hecbench_plugins.regression.plan import Plan  # noqa: E402
from hecbench_plugins.regression.product import write_model  # noqa: E402
from hecbench_plugins.regression.settings import Settings  # noqa: E402
from hecbench_plugins.regression.sketches import Sketches, fit_dense  # noqa: E402
from hecbench_plugins.regression.training import Training  # noqa: E402
from hecbench_plugins.solvers.regression import Regression  # noqa: E402

from hecbench import registry, se3  # noqa: E402
from hecbench.errors import InputError, Refusal, SolverFailure  # noqa: E402
from hecbench.lens import CameraModel  # noqa: E402
from hecbench.recording import Mounting, Recording, RobotDescription  # noqa: E402
from hecbench.robots.model import load_robot  # noqa: E402
from hecbench.specs import Kind, SolverSpec  # noqa: E402

K = np.array([[300.0, 0, 159.5], [0, 300, 119.5], [0, 0, 1]])


def plan(out, robot, **changes):
    settings = {"hours": 1.0, "steps": 4, "size": 64, "batch": 4, "capacity": 6, "sketches": 3, **changes}
    return Plan((str(robot),), out, **settings)


def silent(line):
    pass


@pytest.fixture(scope="module")
def run(tmp_path_factory, crane):
    begun = Training(plan(tmp_path_factory.mktemp("run"), crane), silent)
    begun.run()
    return begun


@pytest.fixture(scope="module")
def folder(run):
    return write_model(run)


def test_a_run_that_was_stopped_ends_as_one_that_was_not(run, crane, tmp_path):
    first = Training(plan(tmp_path, crane), silent)
    first.net.train()
    first.prepare()
    for _ in range(2):
        first._step(first._done())
    first.save()
    lines = []
    second = Training(plan(tmp_path, crane), lines.append)
    assert "goes on after step 2" in lines[0]
    second.run()
    assert second.progress.step == run.progress.step == 4
    for name, value in run.net.state_dict().items():
        assert torch.equal(second.net.state_dict()[name], value), name
    for name, value in run.average.items():
        assert torch.equal(second.average[name], value), name


@pytest.mark.parametrize("name", ["ur5e", "ur3e"])
def test_batched_kinematics_are_the_projects_own(name):
    model = load_robot(name, meshes=False)
    keypoints = keypoints_of(load_robot(name))
    low, high = np.clip(model.limits(), -np.pi, np.pi).T
    joints = np.random.default_rng(0).uniform(low, high, (30, 6))
    root_T_link, points = Kinematics(model, keypoints)(torch.from_numpy(joints), "shoulder_link")
    poses = model.link_poses(joints)
    expected = poses[:, model.link_index("shoulder_link")]
    np.testing.assert_allclose(root_T_link, expected, atol=1e-6)
    local = se3.inverse(expected)[:, None] @ poses
    np.testing.assert_allclose(points, keypoint_positions(model.links, keypoints, local), atol=1e-6)


def test_the_truth_of_every_picture_costs_nothing(run):
    batch = run.shots.batch(np.random.default_rng(1))
    across, down, depth = batch.crop_middle.unbind(1)
    R = batch.crop_R_reference
    numbers = torch.stack(
        [across / depth * batch.focal, down / depth * batch.focal, (depth / batch.focal).log()], 1
    )
    right = torch.cat([numbers, R[:, :, 0], R[:, :, 1]], 1)
    assert losses(right, *batch[2:]).total() < 0.02
    assert losses(right + 0.1, *batch[2:]).total() > 0.1


def test_the_sight_of_a_perception_model_is_as_it_was_there(tmp_path):
    begun = Training(plan(tmp_path, "ur5e", start_from=WEIGHTS), silent)
    batch = begun.shots.batch(begun._rng())
    graph = cv2.dnn.readNetFromONNX(str(WEIGHTS / "perception.onnx"))
    expected = []
    for picture in batch.pictures:
        graph.setInput(picture[None].numpy())
        expected.append(graph.forward()[0].copy())
    found = PerceptionNet.forward(begun.net, batch.pictures).detach()
    np.testing.assert_allclose(found, expected, atol=0.02 * np.abs(expected).max())


def test_places_of_heatmaps():
    heat = torch.full((1, 2, 64, 64), -50.0)
    heat[0, 0, 16, 48] = 0.0
    heat[0, 1] = 0.0
    across, down, spread = places_of(heat, axis_of(64)).view(3, 2)
    np.testing.assert_allclose(across, [48.5 / 64 - 0.5, 0], atol=1e-5)
    np.testing.assert_allclose(down, [16.5 / 64 - 0.5, 0], atol=1e-5)
    np.testing.assert_allclose(spread, [0, (1 / 6) ** 0.5], atol=2e-3)


def test_dense_layers_learn_from_sketches(crane):
    torch.manual_seed(0)
    arm = Family.of([str(crane)]).arms[0]
    sketches, dense, lines = Sketches(arm, np.random.default_rng(0)), Dense(5, 2), []
    sketch = sketches.batch(64)
    assert len(sketch.places) > 32
    before = losses(dense(sketch.places, sketch.postures), *sketch[2:]).total()
    fit_dense(dense, sketches, 40, lines.append)
    assert losses(dense(sketch.places, sketch.postures), *sketch[2:]).total() < 0.8 * before
    assert lines[-1].startswith("sketches, step 40 of 40")


def test_the_graph_answers_as_the_network_does(run):
    net = run.averaged_network().eval()
    image, posture = torch.rand(1, 3, 128, 128), torch.rand(1, 2)
    graph = cv2.dnn.readNetFromONNX(np.frombuffer(to_onnx(net, 2), np.uint8))
    graph.setInput(image.numpy(), "image")
    graph.setInput(posture.numpy(), "posture")
    with torch.no_grad():
        np.testing.assert_allclose(graph.forward(), net(image, posture).numpy(), atol=0.01)


def photographed(robot, **changes):
    recording = Recording(
        name="cell",
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=("0", "1"),
        robot=RobotDescription(urdf=robot, base_link="foot", flange_link="fore"),
        camera=CameraModel(320, 240, K),
        joints_rad=np.array([[0.1, 0.4], [1.0, -0.5]]),
        images=tuple(np.random.default_rng(0).integers(0, 255, (2, 240, 320, 3)).astype(np.uint8)),
    )
    return replace(recording, **changes)


def solved(recording, model):
    settings = Settings(model, largest_blur=1.0, largest_spread_rad=4.0)
    return Regression(settings)(recording, rng=np.random.default_rng(0))


def test_a_solver_answers_by_the_folder(folder, crane, monkeypatch):
    assert {path.name for path in folder.iterdir()} == {
        "README.md", "model.json", "regression.onnx", "curve.csv", "curve.png", "samples.png",
    }  # fmt: skip
    assert (folder / "regression.onnx").stat().st_size < 6e6
    estimate = solved(photographed(crane), folder)
    assert estimate.diagnostics["views"] == 2
    assert se3.is_transform(estimate.parent_T_camera)
    assert (np.linalg.eigvalsh(estimate.covariance) > 0).all()
    swapped = photographed(crane)
    robot = replace(swapped.robot, joint_names=("bend", "turn"))
    swapped = replace(swapped, robot=robot, joints_rad=swapped.joints_rad[:, ::-1])
    np.testing.assert_allclose(solved(swapped, folder).parent_T_camera, estimate.parent_T_camera, atol=1e-9)


def test_what_cannot_be_answered_is_said_in_one_line(folder, crane, tmp_path):
    recording = photographed(crane)
    with pytest.raises(SolverFailure, match=r"model\.json"):
        solved(recording, tmp_path)
    with pytest.raises(Refusal, match="the robot is ur5e, and the network knows crane"):
        solved(replace(recording, robot=RobotDescription(model="ur5e")), folder)
    with pytest.raises(Refusal, match="on the flange"):
        solved(replace(recording, mounting=Mounting.EYE_IN_HAND), folder)
    with pytest.raises(Refusal, match="no image has joints"):
        solved(replace(recording, images=(None, None)), folder)
    for file in folder.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    (tmp_path / "regression.onnx").write_bytes(b"nonsense")
    with pytest.raises(SolverFailure, match="not the file that"):
        solved(recording, tmp_path)


def test_a_graph_that_opencv_cannot_run_is_one_line(folder, crane, tmp_path):
    card, _ = read_network(folder, RegressionCard)
    (tmp_path / "regression.onnx").write_bytes(b"nonsense")
    write_card(tmp_path, msgspec.structs.replace(card, sha256=hashlib.sha256(b"nonsense").hexdigest()))
    with pytest.raises(SolverFailure, match="OpenCV cannot run this graph") as failure:
        solved(photographed(crane), tmp_path)
    assert "\n" not in str(failure.value)


def test_a_run_for_two_robots_is_refused(tmp_path):
    with pytest.raises(InputError, match="--robot: this network is for one robot"):
        Plan(("ur5e", "ur3e"), tmp_path, 1.0).check()


def test_it_trains_and_solves_from_the_command_line(crane, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(training, "_FIRST_PICTURES", 4)
    options = {"--robot": crane, "--out": tmp_path, "--steps": 2, "--batch": 2, "--sketches": 1}
    commands.train.main(
        ["regression", *(str(word) for pair in options.items() for word in pair)], standalone_mode=False
    )
    assert f"{tmp_path / 'model'}: the model" in capsys.readouterr().out
    spec = registry.load().get(Kind.SOLVER, "regression", SolverSpec)
    solver = spec.configured({"model": str(tmp_path / "model")}).factory()
    with pytest.raises(SolverFailure, match="no robot is seen in any of the 2 images"):
        solver(photographed(crane), rng=np.random.default_rng(0))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--hours", "0"], "--hours must be positive"),
        (["--sketches", "-1"], "--sketches must be 0"),
        (["--start-from", "absent.safetensors"], "does not exist"),
        (["--start-from", "."], r"model\.json"),
    ],
)
def test_bad_options_are_one_line(options, message, crane, tmp_path, monkeypatch):
    monkeypatch.setattr(training, "_FIRST_PICTURES", 4)
    words = ["regression", "--robot", str(crane), "--out", str(tmp_path), *options]
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=message):
        commands.train.main(words, standalone_mode=False)
