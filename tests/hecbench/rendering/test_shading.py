"""The lamp at the camera: shades of known shapes, the shaded picture's derivative against finite differences."""

from pathlib import Path

import numpy as np
import pytest

from hecbench import se3
from hecbench.errors import InputError
from hecbench.rendering import Renderer, RenderMesh
from hecbench.robots.meshes import Part
from hecbench.robots.model import RobotModel, load_robot

WIDTH, HEIGHT, FOCAL_PX, AMBIENT = 320, 240, 320.0, 0.3
DENSO = Path("data/robots/denso_vs060/vs060_description/vs060.urdf")
STEPS = np.array([4e-4, 4e-4, 1e-3, 4e-4, 4e-4, 1.5e-3])
SCALE = np.array([1.2, 1.2, 1.2, 1, 1, 1])


def renderer_of(mesh, ambient=AMBIENT, phase=(0, 0)):
    K = np.array([[FOCAL_PX, 0, 159.5 + phase[0]], [0, FOCAL_PX, 119.5 + phase[1]], [0, 0, 1]])
    return Renderer(mesh, K, WIDTH, HEIGHT, ambient)


def shapes(*named):
    parts = tuple(
        Part(name, "body", colour, np.asarray(shape.vertices), np.asarray(shape.faces, np.int32))
        for name, colour, shape in named
    )
    return RenderMesh.of(RobotModel("shapes", (), ("body",), parts))


@pytest.fixture(scope="module")
def ball():
    trimesh = pytest.importorskip("trimesh")
    return shapes(("ball", (1, 0.5, 0.25), trimesh.creation.icosphere(5, 0.3)))


@pytest.fixture(scope="module")
def still_life():
    """A ball before a box beside a cylinder."""
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box((0.3, 0.4, 0.2), se3.exp([0.5, 0.4, 0.2, -0.1, 0, 0.2]))
    tube = trimesh.creation.cylinder(0.12, 0.6, 64, transform=se3.exp([1.0, 0.3, 0, 0.25, 0, 0.1]))
    ball = trimesh.creation.icosphere(4, 0.1)
    ball.apply_translation([-0.05, 0.05, -0.1])
    return shapes(
        ("box", (0.9, 0.4, 0.2), box), ("tube", (0.3, 0.8, 0.4), tube), ("ball", (0.3, 0.4, 0.9), ball)
    )


def test_a_ball_is_as_bright_as_its_normals_say(ball):
    renderer, distance = renderer_of(ball), 1.5
    renderer.draw(se3.make(np.eye(3), [0.1, -0.05, distance])[None])
    image = renderer.image().copy()
    y, x = np.nonzero(renderer.depth < distance - 0.15)  # at its rim a pixel shows a mean
    ray = np.c_[(x - 159.5) / FOCAL_PX, (y - 119.5) / FOCAL_PX, np.ones(len(x))]
    normal = (renderer.depth[y, x, None] * ray - [0.1, -0.05, distance]) / 0.3
    cosine = -(normal * ray).sum(1) / np.linalg.norm(ray, axis=1)
    np.testing.assert_allclose(image[y, x, 0], AMBIENT + (1 - AMBIENT) * cosine, atol=3e-3)
    np.testing.assert_allclose(image[y, x, 1], image[y, x, 0] / 2, rtol=1e-5)
    flat = renderer_of(ball, None)
    flat.draw(se3.make(np.eye(3), [0.1, -0.05, distance])[None])
    np.testing.assert_array_equal(flat.image()[..., 3], image[..., 3])


def test_full_ambient_light_is_flat_colour(still_life):
    poses = se3.exp([0.1, 0.2, 0.3, 0, 0, 1.2])[None]
    images = []
    for ambient in (1.0, None):
        renderer = renderer_of(still_life, ambient)
        renderer.draw(poses)
        images.append(renderer.image(background=(0.1, 0.2, 0.3)))
    np.testing.assert_allclose(*images, atol=1e-6)


def agreement(mesh, poses, ambient, phases):
    """Correlation, and ratio of numeric to analytic derivative, over sub-pixel phases."""
    shape = (HEIGHT, WIDTH, 3, 6)
    analytic, numeric = np.zeros(shape), np.zeros(shape)
    for phase in np.argwhere(np.ones((phases, phases))) / phases:
        renderer = renderer_of(mesh, ambient, phase)
        renderer.draw(poses)
        analytic += renderer.image_derivative()
        for k, step in enumerate(STEPS):
            for sign in (1, -1):
                renderer.draw(se3.exp(sign * step * np.eye(6)[k]) @ poses)
                numeric[..., k] += sign * renderer.image()[..., :3] / (2 * step)
    analytic, numeric = (analytic / SCALE).ravel(), (numeric / SCALE).ravel()
    return np.corrcoef(analytic, numeric)[0, 1], analytic @ numeric / (analytic @ analytic)


def test_inside_a_surface_plain_central_differences_agree(ball):
    """Far from the contour a smooth surface needs no mean over pixel phases."""
    poses, renderer = se3.exp([0.3, 0.2, 0.1, 0.05, 0, 1.0])[None], renderer_of(ball, 0.0)
    renderer.draw(poses)
    inside = renderer.depth < 0.8
    analytic = renderer.image_derivative()[inside].copy()
    numeric = np.zeros_like(analytic)
    for k in range(6):
        for sign in (1, -1):
            renderer.draw(se3.exp(sign * 4e-3 * np.eye(6)[k]) @ poses)
            numeric[..., k] += sign * renderer.image()[inside][:, :3] / 8e-3
    assert np.corrcoef(analytic.ravel(), numeric.ravel())[0, 1] > 0.995
    assert (analytic * numeric).sum() / (analytic**2).sum() == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize("ambient", [None, AMBIENT])
def test_derivative_of_shapes_agrees_with_finite_differences_over_pixel_phases(still_life, ambient):
    correlation, ratio = agreement(still_life, se3.exp([0.1, 0.2, 0.3, 0, 0, 1.0])[None], ambient, 4)
    assert correlation > 0.99
    assert ratio == pytest.approx(1, abs=0.025)


@pytest.mark.parametrize("robot", ["ur5e", "ur3e", DENSO])
def test_derivative_of_robots_agrees_with_finite_differences_over_pixel_phases(robot, shared):
    model = load_robot(robot if isinstance(robot, str) else shared / robot)
    joints = np.deg2rad([0, -80, 100, -90, -90, 0]) if robot != DENSO else np.zeros(6)
    camera_R_base = np.array([[0, 1, 0], [0, 0, -1], [-1, 0, 0.0]])
    poses = se3.make(camera_R_base, [0.05, 0.35, 1.4]) @ model.link_poses(joints)
    correlation, ratio = agreement(RenderMesh.of(model), poses, AMBIENT, 4)
    assert correlation > 0.96  # letters and grooves smaller than a pixel
    assert ratio == pytest.approx(1, abs=0.04)


def test_the_derivative_leaves_nothing_behind(still_life):
    first, second = (se3.exp([0.1, 0.2, 0.3, x, 0, 1.2])[None] for x in (0.2, -0.2))
    renderer = renderer_of(still_life)
    renderer.draw(first)
    renderer.image_derivative()
    renderer.draw(second)
    found = renderer.image_derivative()
    fresh = renderer_of(still_life)
    fresh.draw(second)
    np.testing.assert_array_equal(found, fresh.image_derivative())


def test_a_share_of_light_is_between_0_and_1(ball):
    with pytest.raises(InputError, match="ambient"):
        renderer_of(ball, 1.5)
