"""Training at a toy's size: it learns, goes on after an interruption, and leaves a model that OpenCV runs."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("safetensors")
pytest.importorskip("onnx")

from hecbench_plugins.perception import commands  # noqa: E402
from hecbench_plugins.perception.losses import losses  # noqa: E402
from hecbench_plugins.perception.model import PerceptionModel  # noqa: E402
from hecbench_plugins.perception.network import PerceptionNet  # noqa: E402
from hecbench_plugins.perception.onnx_export import to_onnx  # noqa: E402
from hecbench_plugins.perception.plan import Plan  # noqa: E402
from hecbench_plugins.perception.product import write_model  # noqa: E402
from hecbench_plugins.perception.run import CHECKPOINT  # noqa: E402
from hecbench_plugins.perception.training import Training  # noqa: E402

from hecbench.errors import InputError  # noqa: E402


def plan(out, crane, **changes):
    settings = {"hours": 1.0, "steps": 6, "size": 64, "batch": 4, "capacity": 16, **changes}
    return Plan((str(crane),), out, **settings)


def trained(out, crane, **changes):
    training = Training(plan(out, crane, **changes), lambda line: None)
    training.run()
    return training


@pytest.fixture(scope="module")
def run(tmp_path_factory, crane):
    return trained(tmp_path_factory.mktemp("run"), crane)


def test_losses_are_least_for_the_truth():
    shares = torch.zeros(1, 3, 8, 8)
    shares[:, 0], shares[:, 1, 2:6, 2:6], shares[:, 0, 2:6, 2:6], shares[:, 2, 2:6, 2:6] = 1, 1, 0, 1
    points = torch.tensor([[[3.0, 4.0], [float("nan"), 0.0]]])
    right = torch.full((1, 5, 8, 8), -6.0)
    right[:, :2] = torch.where(shares[:, :2] > 0.5, 6.0, -6.0)
    right[:, 2] = torch.where(shares[:, 2] > 0.5, 6.0, -6.0)
    right[:, 3] = -((torch.arange(8.0)[None] - 3) ** 2 + (torch.arange(8.0)[:, None] - 4) ** 2)
    right[:, 4] = 0.0
    wrong = right.roll(2, 3)
    known = torch.tensor([True])
    for ours, theirs in zip(
        losses(right, shares, points, known), losses(wrong, shares, points, known), strict=True
    ):
        assert torch.isfinite(ours)
        assert ours < theirs or torch.equal(ours, theirs)
    assert losses(right, shares, points, known).total() < losses(wrong, shares, points, known).total()


def test_what_is_visible_counts_where_it_is_known():
    shares, points = torch.rand(2, 3, 8, 8), torch.rand(2, 2, 2)
    logits = torch.randn(2, 5, 8, 8)
    other = logits.clone()
    other[1, 2] += 3
    half = torch.tensor([True, False])
    assert losses(logits, shares, points, half).visible == losses(other, shares, points, half).visible
    assert losses(logits, shares, points, ~half).visible != losses(other, shares, points, ~half).visible
    first = losses(logits[:1], shares[:1], points[:1], torch.tensor([True]))
    assert torch.isclose(losses(logits, shares, points, half).visible, first.visible)
    assert losses(logits, shares, points, half & ~half).visible == 0


def test_a_run_writes_a_model_that_opencv_runs(run):
    folder = write_model(run)
    assert {path.name for path in folder.iterdir()} == {
        "README.md",
        "model.json",
        "perception.onnx",
        "curve.csv",
        "curve.png",
        "samples.png",
    }
    model = PerceptionModel(folder)
    assert model.card.robots == ("crane",)
    assert model.card.training["steps"] == 6
    image = np.random.default_rng(0).integers(0, 255, (100, 140, 3)).astype(np.uint8)
    assert model.see(image).whole().shape == (100, 140)


def test_the_graph_answers_as_the_network_does(run, tmp_path):
    import cv2

    net = PerceptionNet(run.net.classes, run.net.keypoints).eval()
    net.load_state_dict(run.average)
    x = torch.rand(1, 3, 96, 64)
    graph = cv2.dnn.readNetFromONNX(np.frombuffer(to_onnx(net), np.uint8))
    graph.setInput(x.numpy())
    with torch.no_grad():
        expected = net(x).numpy()
    np.testing.assert_allclose(graph.forward(), expected, atol=0.02 * np.abs(expected).max())


def test_an_interrupted_run_goes_on(run, crane, tmp_path):
    (tmp_path / CHECKPOINT).write_bytes(run.path.read_bytes())
    lines = []
    again = Training(plan(tmp_path, crane, steps=9), lines.append)
    assert "goes on after step 6" in lines[0]
    assert again.progress.step == 6
    for name, value in run.net.state_dict().items():
        assert torch.equal(again.net.state_dict()[name], value)
    for weight, other in zip(again.net.parameters(), run.net.parameters(), strict=True):
        assert torch.equal(again.optimiser.state[weight]["exp_avg"], run.optimiser.state[other]["exp_avg"])
    again.run()
    assert again.progress.step == 9


def test_it_learns(crane, tmp_path):
    training = trained(tmp_path, crane, steps=60, rate=3e-3, batch=8, capacity=32)
    first = Training(plan(tmp_path / "other", crane), lambda line: None)
    first.pool = training.pool

    def total(net, seed):
        torch.manual_seed(seed)
        images, *wanted = training._batch()
        net.train()
        with torch.no_grad():
            return float(sum(losses(net(images), *wanted)[:3]))

    before, after = ([total(net, seed) for seed in range(5)] for net in (first.net, training.net))
    assert np.mean(after) < 0.9 * np.mean(before)


def test_a_checkpoint_of_another_robot_or_none_is_refused(run, tmp_path):
    with pytest.raises(InputError, match="give another --out"):
        Training(Plan(("ur5e",), run.plan.out, 1.0), print)
    (tmp_path / CHECKPOINT).write_bytes(b"nonsense")
    with pytest.raises(InputError, match="not a checkpoint"):
        Training(Plan(("ur5e",), tmp_path, 1.0), print)
    with pytest.raises(InputError, match="weights of another network"):
        Training(Plan(("ur5e",), tmp_path / "new", 1.0, start_from=run.path), print)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"hours": 0}, "--hours must be positive"),
        ({"size": 100}, "multiple of 32"),
        ({"batch": 1}, "--batch must be 2"),
        ({"steps": 0}, "--steps must be 1"),
    ],
)
def test_bad_settings_name_their_option(changes, message, tmp_path, crane):
    with pytest.raises(InputError, match=message):
        plan(tmp_path, crane, **changes).check()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"start_from": "absent.safetensors"}, "does not exist"),
        ({"backgrounds": "."}, "no readable"),
    ],
)
def test_files_that_are_not_there(changes, message, tmp_path, crane):
    settings = {name: tmp_path / value for name, value in changes.items()}
    with pytest.raises(InputError, match=message):
        Training(plan(tmp_path, crane, **settings), print)


def test_without_torch_the_extra_is_named(monkeypatch, tmp_path):
    monkeypatch.setattr(commands, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"hecbench\[torch\]"):
        commands.perception.main(["--robot", "ur5e", "--out", str(tmp_path)], standalone_mode=False)
