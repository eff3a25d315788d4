"""The published translators at a toy's size: what their losses ask, training that goes on, and running by OpenCV."""

import numpy as np
import pytest
from hecbench_plugins.translation.plan import Method, Plan
from hecbench_plugins.translators.trained import load

from hecbench.errors import InputError

torch = pytest.importorskip("torch")
pytest.importorskip("safetensors")
pytest.importorskip("onnx")

from hecbench_plugins.perception.family import Family  # noqa: E402
from hecbench_plugins.translation.networks import networks_of  # noqa: E402
from hecbench_plugins.translation.objectives import Pictures, generators_loss, judges_loss, soft_mask  # noqa: E402
from hecbench_plugins.translation.pictures import Pairs, as_drawn, as_photographed  # noqa: E402
from hecbench_plugins.translation.training import Training, write_model  # noqa: E402

SIZE = 32


@pytest.fixture(scope="module")
def seen():
    torch.manual_seed(0)
    mask = torch.zeros(1, 1, SIZE, SIZE)
    mask[..., 8:24, 8:24] = 1
    photo = 2 * mask * torch.rand(1, 3, SIZE, SIZE) - 1
    return Pictures(photo, mask, 2 * 0.5 * mask.expand(-1, 3, -1, -1) - 1, mask)


def plan(method, out, **changes):
    return Plan(method, ("ur5e",), out, **{"steps": 4, "size": SIZE, **changes})


@pytest.mark.parametrize("method", list(Method))
def test_every_network_learns_from_its_loss(method, tmp_path, seen):
    nets = networks_of(plan(method, tmp_path))
    terms, made, back = generators_loss(nets, method, seen)
    assert made.shape == seen.photo.shape
    sum(terms.values()).backward()
    for name in ("to_drawn", "to_photo", "heads"):
        if name in nets:
            assert any(weight.grad is not None and weight.grad.any() for weight in nets[name].parameters()), (
                name
            )
    nets.zero_grad()
    judges_loss(nets, method, seen, made.detach(), back.detach()).backward()
    assert all(weight.grad is None or not weight.grad.any() for weight in nets["to_drawn"].parameters())
    assert any(weight.grad.any() for weight in nets["drawn"].parameters())


def test_the_mask_loss_punishes_a_picture_that_loses_the_robot(seen):
    class Same(torch.nn.Module):
        def forward(self, x):
            return x

    class Black(torch.nn.Module):
        def forward(self, x):
            return torch.full_like(x, -1.0) + 0 * x

    nets = networks_of(plan(Method.CYCLEGAN_MASK, "unused"))
    found = []
    for generator in (Same(), Black()):
        nets["to_drawn"], nets["to_photo"] = generator, generator
        found.append(float(generators_loss(nets, Method.CYCLEGAN_MASK, seen)[0]["mask"]))
    assert found[0] < 0.3 * found[1]
    assert found[1] == pytest.approx(2 * float(seen.photo_mask.mean()), abs=0.1)


def test_the_soft_mask_is_the_mask_of_a_drawn_picture(seen):
    assert float((soft_mask(seen.drawn) - seen.drawn_mask).abs().max()) < 0.1


def test_pictures_are_black_around_the_robot():
    family = Family.of(["ur5e"])
    pairs = Pairs(family, 64, (3,))
    for _ in range(5):
        pairs.draw()
    for example in pairs.examples:
        photo, drawn = as_photographed(example), as_drawn(example, family.palette)
        outside = photo.mask[0] == 0
        assert outside.any()
        assert (photo.picture[:, outside] == -1).all()
        assert (drawn.picture[:, outside] == -1).all()
        assert drawn.picture.max() > 0


def test_a_run_goes_on_and_its_model_is_run_by_opencv(tmp_path):
    first = Training(plan(Method.CYCLEGAN_MASK, tmp_path), print)
    first.run()
    lines = []
    again = Training(plan(Method.CYCLEGAN_MASK, tmp_path, steps=6), lines.append)
    assert "goes on after step 4" in lines[0]
    for name, value in first.nets.state_dict().items():
        assert torch.equal(again.nets.state_dict()[name], value)
    again.run()
    assert again.progress.step == 6
    folder = write_model(again)
    translate = load("cyclegan_mask", str(folder))
    rng = np.random.default_rng(0)
    mask = np.zeros((60, 90), np.float32)
    mask[20:50, 30:70] = 1
    found = translate(
        rng.random((60, 90, 3), np.float32), mask, part=np.zeros((60, 90), np.int32), colours=np.eye(3)
    )
    assert found.shape == (60, 90, 3)
    assert not found[mask == 0].any()
    assert found[mask > 0].any()
    assert not translate(
        np.ones((60, 90, 3), np.float32), 0 * mask, part=mask.astype(np.int32), colours=np.eye(3)
    ).any()
    with pytest.raises(InputError, match="a cyclegan_mask of format 1, not a cut"):
        load("cut", str(folder))
    (folder / "generator.onnx").write_bytes(b"nonsense")
    with pytest.raises(InputError, match="not the file that"):
        load("cyclegan_mask", str(folder))
    with pytest.raises(InputError, match="give another --out"):
        Training(plan(Method.CUT, tmp_path), print)


def test_what_is_missing_is_one_line(tmp_path):
    with pytest.raises(InputError, match=r"hecbench train translation --method cut"):
        load("cut")
    with pytest.raises(InputError, match="does not exist"):
        load("cut", str(tmp_path))
    with pytest.raises(InputError, match="--size must be"):
        plan(Method.CUT, tmp_path, size=40).check()
    with pytest.raises(InputError, match="--steps must be"):
        plan(Method.CUT, tmp_path, steps=1).check()
