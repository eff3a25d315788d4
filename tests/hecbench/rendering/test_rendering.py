"""The rasteriser against supersampling, ray casting and finite differences, and its defined corner cases."""

import numpy as np
import pytest
from scipy import ndimage

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import CameraModel
from hecbench.rendering import Renderer, RenderMesh
from hecbench.rendering.undistort import Undistortion
from hecbench.robots.model import load_robot

WIDTH, HEIGHT = 320, 240
K = np.array([[320.0, 0, 159.5], [0, 320.0, 119.5], [0, 0, 1]])
BENT = np.deg2rad([0, -90, 90, -90, -90, 0])
DENSO = "data/robots/denso_vs060/vs060_description/vs060.urdf"


@pytest.fixture(scope="module")
def arm():
    return load_robot("ur5e")


@pytest.fixture(scope="module")
def mesh(arm):
    return RenderMesh.of(arm)


@pytest.fixture(scope="module")
def renderer(mesh):
    return Renderer(mesh, K, WIDTH, HEIGHT)


def camera_T_base(rng, distance=2.0):
    eye = np.array([distance, 0, 0.35]) + rng.normal(0, 0.2, 3)
    forward = np.array([0.2, 0, 0.35]) - eye
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    rotation = se3.so3_exp([0, 0, rng.uniform(-0.4, 0.4)]) @ np.stack(
        [right, np.cross(forward, right), forward]
    )
    return se3.make(rotation, -rotation @ eye)


def pose(arm, rng, distance=2.0):
    joints = BENT + rng.uniform(-0.2, 0.2, 6)
    return camera_T_base(rng, distance) @ arm.link_poses(joints, frame="base")


def finer(factor):
    fine = K.copy()
    fine[:2] *= factor
    fine[:2, 2] += (factor - 1) / 2
    return fine


def test_coverage_agrees_with_256_samples_per_pixel(arm, mesh, renderer, rng):
    fine = Renderer(mesh, finer(16), 16 * WIDTH, 16 * HEIGHT)
    errors = []
    for _ in range(2):
        camera_T_link = pose(arm, rng)
        renderer.draw(camera_T_link)
        coverage = renderer.image()[..., 3]
        fine.draw(camera_T_link)
        sampled = (fine.face >= 0).reshape(HEIGHT, 16, WIDTH, 16).mean((1, 3))
        edge = (sampled > 0) & (sampled < 1)
        errors.append(np.abs(coverage - sampled)[edge])
        assert abs(coverage.sum() / sampled.sum() - 1) < 2e-3
    assert np.concatenate(errors).mean() < 0.04
    assert np.percentile(np.concatenate(errors), 95) < 0.15


def test_derivative_agrees_with_finite_differences_over_pixel_phases(arm, mesh, rng):
    camera_T_link = pose(arm, rng, 1.2)
    steps = np.array([4e-4, 4e-4, 1e-3, 4e-4, 4e-4, 1.5e-3])
    shape = (HEIGHT * WIDTH, 3, 6)
    analytic, numeric = np.zeros(shape), np.zeros(shape)
    for phase in np.argwhere(np.ones((5, 5))) / 5:
        shifted = K.copy()
        shifted[:2, 2] += phase
        renderer = Renderer(mesh, shifted, WIDTH, HEIGHT)
        renderer.draw(camera_T_link)
        analytic += renderer.image_derivative().reshape(shape)
        for k, step in enumerate(steps):
            for sign in (1, -1):
                renderer.draw(se3.exp(sign * step * np.eye(6)[k]) @ camera_T_link)
                numeric[..., k] += sign * renderer.image()[..., :3].reshape(-1, 3) / (2 * step)
    scale = np.array([1.2, 1.2, 1.2, 1, 1, 1])
    analytic, numeric = (analytic / scale).ravel(), (numeric / scale).ravel()
    assert np.corrcoef(analytic, numeric)[0, 1] > 0.985
    assert analytic @ numeric / (analytic @ analytic) == pytest.approx(1, abs=0.03)


def test_depth_part_and_link_agree_with_ray_casting(arm, mesh, renderer, rng):
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("embreex")
    camera_T_link = pose(arm, rng)
    renderer.draw(camera_T_link)
    scene = [
        trimesh.Trimesh(
            se3.transform_points(camera_T_link[arm.link_index(part.link)], part.vertices),
            part.faces,
            process=False,
        )
        for part in arm.parts
    ]
    part_of_face = np.repeat(np.arange(len(scene)), [len(shape.faces) for shape in scene])
    whole = trimesh.util.concatenate(scene)
    v, u = np.mgrid[0:HEIGHT:2, 0:WIDTH:2]
    rays = np.stack([u, v, np.ones_like(u)], -1).reshape(-1, 3) @ np.linalg.inv(K).T
    place, ray, triangle = whole.ray.intersects_location(np.zeros_like(rays), rays, multiple_hits=False)
    depth = np.full(len(rays), np.inf)
    depth[ray] = place[:, 2]
    part = np.full(len(rays), -1)
    part[ray] = part_of_face[triangle]
    mine = renderer.depth[::2, ::2].reshape(-1)
    assert ((mine < np.inf) == (depth < np.inf)).mean() > 0.9995
    both = (mine < np.inf) & (depth < np.inf)
    assert (np.abs(mine[both] - depth[both]) < 1e-3).mean() > 0.99
    names = np.array([renderer.mesh.part_names.index(p.name) for p in arm.parts])
    seen = renderer.part[::2, ::2].reshape(-1)[both]
    assert (seen == names[part[both]]).mean() > 0.98
    np.testing.assert_array_equal(renderer.link[::2, ::2].reshape(-1)[both], mesh.part_link[seen])


def test_a_call_leaves_nothing_behind(arm, mesh, renderer, rng):
    first, second = pose(arm, rng), pose(arm, rng, 1.0)
    renderer.draw(first)
    expected = renderer.image(background=(0.2, 0.3, 0.4)).copy()
    renderer.draw(second)
    renderer.image()
    renderer.draw(first)
    np.testing.assert_array_equal(renderer.image(background=(0.2, 0.3, 0.4)), expected)
    fresh = Renderer(mesh, K, WIDTH, HEIGHT)
    fresh.draw(first)
    np.testing.assert_array_equal(fresh.image(background=(0.2, 0.3, 0.4)), expected)


def test_out_of_view_behind_and_clipped(arm, renderer, rng):
    seen = pose(arm, rng)
    for hidden in (
        np.diag([1.0, 1, -1, 1]),
        se3.make(np.eye(3), [50, 0, 0]),
        se3.make(np.eye(3), [0, 0, -9]),
    ):
        assert renderer.draw(hidden @ seen) == 0
        assert not renderer.image().any()
    renderer.draw(se3.make(np.eye(3), [0.9, 0, 0]) @ seen)
    coverage = renderer.image()[..., 3]
    assert coverage[:, -1].any()
    assert np.isfinite(coverage).all()
    renderer.draw(se3.make(np.eye(3), [0, 0, -2.0]) @ seen)
    assert renderer.dropped > 0  # the camera is inside the robot


def test_coarse_mesh_stays_within_its_measured_error(arm, mesh):
    coarse = RenderMesh.of(arm, cell_m=0.004)
    assert len(coarse.faces[0]) == 3
    assert len(coarse.faces) < 0.7 * len(mesh.faces)
    assert 0 < coarse.error_m < 0.004 * np.sqrt(3)
    renderers = [Renderer(m, K, WIDTH, HEIGHT) for m in (mesh, coarse)]
    camera_T_link = pose(arm, np.random.default_rng(0))
    covered = []
    for renderer in renderers:
        renderer.draw(camera_T_link)
        covered.append(renderer.image()[..., 3].copy())
    perimeter = ((covered[0] > 0) & (covered[0] < 1)).sum()
    bound_px = K[0, 0] * coarse.error_m / renderers[0].depth.min()
    assert np.abs(covered[0] - covered[1]).sum() < bound_px * perimeter


@pytest.mark.parametrize("count", [0, 4, 5, 8, 12, 14])
def test_undistorted_points_agree_with_opencv(count, rng):
    cv2 = pytest.importorskip("cv2")
    size = np.array([0.1, 0.05, 0.01, 0.01, 0.01, 0.05, 0.02, 0.01, 0.01, 0.01, 0.01, 0.01, 0.05, 0.05])
    camera = CameraModel(WIDTH, HEIGHT, K, (size * rng.uniform(-1, 1, 14))[:count])
    picture = rng.uniform(0, 1, (HEIGHT, WIDTH)).astype(np.float32)
    expected = cv2.remap(
        picture,
        *cv2.initUndistortRectifyMap(K, camera.distortion, None, K, (WIDTH, HEIGHT), cv2.CV_32FC1),
        cv2.INTER_LINEAR,
    )
    found = Undistortion.of(camera).image(picture)
    inside = (slice(30, -30), slice(30, -30))
    assert np.abs(found - expected)[inside].max() < 0.05  # cv2 interpolates at 1/32 px


def test_collada_robot_is_drawn(shared):
    model = load_robot(shared / DENSO)
    renderer = Renderer(RenderMesh.of(model), K, WIDTH, HEIGHT)
    renderer.draw(camera_T_base(np.random.default_rng(2)) @ model.link_poses(np.zeros(6)))
    assert 1000 < renderer.image()[..., 3].sum() < 10000


def test_bad_input_is_refused(arm, mesh, renderer):
    with pytest.raises(InputError, match="K must be"):
        Renderer(mesh, np.full((3, 3), np.nan), 10, 10)
    with pytest.raises(InputError, match="cannot be drawn"):
        Renderer(mesh, K, 1, 10)
    with pytest.raises(InputError, match="11 finite link poses"):
        renderer.draw(np.full((11, 4, 4), np.nan))
    with pytest.raises(InputError, match="no visual meshes"):
        RenderMesh.of(load_robot("ur5e", meshes=False))


def test_undistorted_pictures_are_resampled_as_scipy_does(rng):
    camera = CameraModel(
        30, 20, np.array([[25.0, 0, 14.5], [0, 25.0, 9.5], [0, 0, 1]]), np.array([0.4, 0.1, 0.01, 0.0])
    )
    picture = rng.random((20, 30, 3)).astype(np.float32)
    pinhole = Undistortion.of(camera)
    expected = [
        ndimage.map_coordinates(picture[..., c], pinhole._source, order=1, mode="constant") for c in range(3)
    ]
    np.testing.assert_allclose(pinhole.image(picture), np.stack(expected, -1), atol=1e-6)
    assert (pinhole.image(picture) == 0).any()
