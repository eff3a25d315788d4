"""Adam and the losses of one pass against torch's own operators."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from hecbench_plugins.first_order.adam import Adam  # noqa: E402
from hecbench_plugins.first_order.drawing import Box  # noqa: E402
from hecbench_plugins.first_order.losses import SquaredError, geometry, geometry_of  # noqa: E402

WIDTH, HEIGHT = 40, 30
BOX = Box(5, 16, 7, 14)


class StillDrawer:
    """A drawer of which only size and box count."""

    width, height, box = WIDTH, HEIGHT, BOX


@pytest.fixture
def picture(rng):
    shape = (4, BOX.y1 - BOX.y0 + 1, BOX.x1 - BOX.x0 + 1)
    values = rng.uniform(0, 1.4, shape)
    values[3, :2], values[3, 2:4] = 0, 1
    return torch.tensor(values, dtype=torch.float32, requires_grad=True)


def whole(picture):
    """The picture on an empty background."""
    full = torch.zeros((picture.shape[0], HEIGHT, WIDTH))
    full[(slice(None), *BOX.slices)] = picture
    return full


def both_slopes(mine, theirs, picture):
    return [torch.autograd.grad(loss, picture)[0].numpy() for loss in (mine, theirs)]


@pytest.mark.parametrize("decay", [0.0, 0.1])
def test_adam_is_torchs(decay, rng):
    start = rng.normal(size=3)
    mine, theirs = Adam(start.copy(), 0.01, decay), torch.tensor(start, requires_grad=True)
    adam = torch.optim.Adam([theirs], lr=0.01, weight_decay=decay)
    for _ in range(50):
        slope = rng.normal(size=3)
        theirs.grad = torch.tensor(slope)
        adam.step()
        mine.step(slope)
    np.testing.assert_allclose(mine.values, theirs.detach().numpy(), atol=1e-12)


def test_adam_that_restarts_has_forgotten(rng):
    first, second = Adam(np.zeros(3), 0.01), Adam(np.zeros(3), 0.01)
    for _ in range(5):
        first.step(rng.normal(size=3))
    first.restart()
    first.values[:] = 0
    for adam in (first, second):
        adam.step(np.array([1.0, -2.0, 3.0]))
    np.testing.assert_array_equal(first.values, second.values)


@pytest.mark.parametrize("ceiling", [np.inf, 1.0])
def test_squared_error_is_the_sum_over_all_pixels(ceiling, picture, rng):
    reference = rng.uniform(size=(3, HEIGHT, WIDTH)).astype(np.float32)
    mine = SquaredError(reference, StillDrawer(), ceiling)(picture)
    drawn = whole(picture)[:3].clamp(max=ceiling)
    theirs = ((drawn - torch.from_numpy(reference)) ** 2).sum()
    np.testing.assert_allclose(float(mine.detach()), float(theirs.detach()), rtol=1e-5)
    np.testing.assert_allclose(*both_slopes(mine, theirs, picture), atol=1e-5)


def test_geometry_is_softmax_centroid_and_sigmoid_area(picture):
    mask = whole(picture)[3].double()
    share = torch.softmax(mask.reshape(-1), 0).reshape(mask.shape)
    columns, rows = torch.arange(WIDTH) - (WIDTH - 1) / 2, torch.arange(HEIGHT) - (HEIGHT - 1) / 2
    area = torch.sigmoid(mask).sum() - 0.5 * mask.numel()
    theirs = torch.stack([(share.sum(0) * columns).sum(), (share.sum(1) * rows).sum(), area])
    mine = geometry(picture, 3, StillDrawer())
    np.testing.assert_allclose(mine.detach(), theirs.detach(), atol=1e-6)
    np.testing.assert_allclose(geometry_of(mask.detach().float().numpy()), theirs.detach(), atol=1e-6)
    weights = torch.tensor([0.3, -0.7, 0.2], dtype=torch.float64)
    np.testing.assert_allclose(*both_slopes(mine @ weights, theirs @ weights, picture), atol=1e-6)
