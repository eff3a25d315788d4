"""The renderer as a function of torch: its derivative, averaged over sub-pixel phases, is the slope of the loss."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from hecbench_plugins.first_order.drawing import MASK, BoxSum, CpuDrawer, link_mask_meshes, whole_mask_mesh  # noqa: E402
from hecbench_plugins.first_order.poses import Increment  # noqa: E402
from hecbench_plugins.first_order.rendered import rendered  # noqa: E402
from hecbench_plugins.views.pyramid import meshes_by_level, prepare  # noqa: E402

from hecbench import se3  # noqa: E402
from hecbench.robots.posed import cached_robot  # noqa: E402

PHASES = 24


@pytest.fixture(scope="module")
def view(scene):
    return prepare(scene)[1][0]


def drawer_of(kind, view):
    if kind == "colours":
        mesh = meshes_by_level(cached_robot("ur5e"))[1]
        table = np.zeros((len(mesh.colours) + 1, 4), np.float32)
        table[:-1, :3], table[:-1, 3] = mesh.colours, 1
        meshes = (mesh,)
    else:
        meshes = (
            (whole_mask_mesh(cached_robot("ur5e")),)
            if kind == "zbuffered"
            else link_mask_meshes(cached_robot("ur5e"))
        )
        table = MASK
    renderer = view.levels[1].renderer
    return CpuDrawer(meshes, table, view, renderer.K, renderer.width, renderer.height)


@pytest.mark.parametrize("kind", ["zbuffered", "per_link", "colours"])
def test_mean_derivative_along_a_way_is_the_difference_of_its_ends(kind, scene, view):
    drawer = drawer_of(kind, view)
    numbers = Increment(se3.inverse(scene.truth_parent_T_camera))
    rows, columns = np.mgrid[: drawer.height, : drawer.width]
    field = torch.from_numpy(
        np.float32(np.sin(columns / 37) + np.cos(rows / 29) + columns / 400 + rows / 300)
    )

    def loss_and_slope(values):
        leaves = [torch.tensor(part, requires_grad=True) for part in (values[:3], values[3:])]
        picture = rendered(*leaves, drawer, numbers, numbers.pose(values[:3], values[3:]))
        loss = (picture * field[drawer.box.slices]).sum()
        loss.backward()
        return float(loss.detach()), np.concatenate([leaf.grad.numpy() for leaf in leaves])

    half = np.array([0.01, 0.01, 0.05, 0.01, 0.01, 0.01])
    differences, means = [], []
    for direction in np.eye(6):
        way = np.diag(half) @ direction
        differences.append(loss_and_slope(way)[0] - loss_and_slope(-way)[0])
        phases = (np.arange(PHASES) + 0.5) / PHASES * 2 - 1
        means.append(np.mean([loss_and_slope(phase * way)[1] for phase in phases], 0) @ (2 * way))
    scale = np.abs(differences).max()
    np.testing.assert_allclose(np.array(means) / scale, np.array(differences) / scale, atol=0.03)


def test_the_links_masks_added_up_hold_the_whole_mask(scene, view):
    pose = se3.inverse(scene.truth_parent_T_camera)
    whole, links = drawer_of("zbuffered", view), drawer_of("per_link", view)
    one, several = whole.draw(pose), links.draw(pose)
    assert whole.box == links.box
    assert several.sum() > one.sum()
    off = np.abs(np.minimum(several, 1) - one)
    assert (off > 0.1).mean() < 0.002, "they differ at seams between links only"


def test_a_robot_behind_the_camera_is_not_in_the_picture(scene, view):
    drawer = drawer_of("zbuffered", view)
    behind = np.diag([1.0, -1.0, -1.0, 1.0]) @ se3.inverse(scene.truth_parent_T_camera)
    assert drawer.draw(behind).shape == (1, 0, 0)
    assert drawer.box is None
    np.testing.assert_array_equal(drawer.pull(np.zeros((1, 0, 0), np.float32)), np.zeros(6))


def test_box_sums(rng, view, scene):
    field = rng.uniform(size=(480, 640))
    drawer = drawer_of("zbuffered", view)
    drawer.draw(se3.inverse(scene.truth_parent_T_camera))
    sums = BoxSum(field)
    outside = field.sum() - field[drawer.box.slices].sum()
    np.testing.assert_allclose([sums.outside(drawer.box), sums.outside(None)], [outside, field.sum()])
