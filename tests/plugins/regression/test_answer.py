"""What the network's numbers mean, the pictures that it is shown, and one camera of many views."""

import numpy as np
import pytest
from hecbench_plugins.regression.answer import columns, decode
from hecbench_plugins.regression.combining import SHARED_VARIANCE, combined, l1_mean
from hecbench_plugins.regression.reference import posture, reference_link
from hecbench_plugins.regression.virtual_camera import VirtualCamera, towards
from hypothesis import given
from hypothesis import strategies as st

from hecbench import se3
from hecbench.errors import InputError
from hecbench.lens import CameraModel, distort
from hecbench.robots.model import RobotModel, load_robot

K = np.array([[600.0, 0, 330], [0, 610, 250], [0, 0, 1]])


@given(st.integers(0, 2**32 - 1))
def test_six_numbers_are_a_rotation(seed):
    six = np.random.default_rng(seed).normal(size=(5, 6))
    R = np.stack(columns(six), -1)
    np.testing.assert_allclose(R @ R.swapaxes(1, 2), np.tile(np.eye(3), (5, 1, 1)), atol=1e-6)
    np.testing.assert_allclose(np.linalg.det(R), 1, atol=1e-6)


def test_the_first_two_columns_of_a_rotation_are_its_six_numbers():
    R = se3.so3_exp(np.random.default_rng(0).normal(size=(20, 3)))
    six = np.concatenate([R[..., 0], R[..., 1]], -1)
    np.testing.assert_allclose(np.stack(columns(six), -1), R, atol=1e-9)
    stretched = np.concatenate([3 * R[..., 0], 2 * R[..., 1] - 5 * R[..., 0]], -1)
    np.testing.assert_allclose(np.stack(columns(stretched), -1), R, atol=1e-9)


def test_torch_reads_the_numbers_alike():
    torch = pytest.importorskip("torch")
    numbers, focal = np.random.default_rng(1).normal(size=(7, 9)), np.linspace(0.5, 3, 7)
    ours, theirs = decode(numbers, focal), decode(torch.from_numpy(numbers), torch.from_numpy(focal))
    for a, b in zip((*ours[:3], *ours.middle), (*theirs[:3], *theirs.middle), strict=True):
        np.testing.assert_allclose(a, b.numpy(), atol=1e-12)


def test_the_middle_is_where_the_numbers_put_it_in_the_picture():
    x, y, depth = decode(np.array([0.1, -0.2, np.log(1.5), 1, 0, 0, 0, 1, 0]), 2.0).middle
    assert (x / depth * 2.0, y / depth * 2.0) == pytest.approx((0.1, -0.2))
    assert depth == pytest.approx(3.0)


@pytest.mark.parametrize("ray", [(0, 0, 1), (0.3, -0.2, 1), (1, 2, -0.5), (0, 0, -1)])
def test_a_turn_towards_a_ray(ray):
    R = towards(ray)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(R[:, 2], np.array(ray) / np.linalg.norm(ray), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1)


@pytest.mark.parametrize(
    "camera",
    [
        CameraModel(640, 480, K),
        CameraModel(640, 480, K, np.array([-0.2, 0.05, 0.001, -0.002, 0.0])),
        CameraModel(640, 480, K, np.array([0.05, 0.01, 0.0, 0.0]), "equidistant"),
    ],
    ids=("pinhole", "distorted", "fisheye"),
)
def test_a_virtual_camera_shows_a_point_where_its_pinhole_has_it(camera):
    point = np.array([0.25, -0.1, 1.4])
    u, v = camera.K[:2, :2] @ distort(point[None, :2] / point[2], camera)[0] + camera.K[:2, 2]
    rows, columns_ = np.mgrid[0:480, 0:640]
    image = np.repeat((255 * np.exp(-((columns_ - u) ** 2 + (rows - v) ** 2) / 60))[..., None], 3, 2)
    view = VirtualCamera.at(point + 0.2 * np.eye(3), 0.6, aside=(0.1, -0.05), roll=0.2)
    picture = view.picture(image.astype(np.uint8), camera, 128)[..., 0].astype(float)
    found = np.array([(picture * axis).sum() for axis in np.mgrid[0:128, 0:128][::-1]]) / picture.sum()
    p = view.camera_R_crop.T @ point
    np.testing.assert_allclose(found, 63.5 + 128 * view.focal * p[:2] / p[2], atol=0.3)


def test_points_take_their_share_of_the_picture():
    points = np.random.default_rng(2).normal([0.4, 0.2, 2.0], 0.3, (10, 3))
    view = VirtualCamera.at(points, 0.7)
    p = points @ view.camera_R_crop
    seen = view.focal * p[:, :2] / p[:, 2:]
    assert np.ptp(seen, 0).max() == pytest.approx(0.7, abs=0.1)  # the links' radius is part of the share
    np.testing.assert_allclose(seen.min(0) + seen.max(0), 0, atol=0.05)


def test_the_whole_picture_is_seen():
    view = VirtualCamera.whole(CameraModel(640, 480, K))
    corners = np.array([[0, 240, 1], [639, 240, 1.0]]) @ np.linalg.inv(K).T @ view.camera_R_crop
    assert np.abs(view.focal * corners[:, 0] / corners[:, 2]).max() == pytest.approx(0.5, abs=0.02)


def test_the_pose_in_the_reference_frame_does_not_depend_on_the_first_joint():
    model = load_robot("ur5e", meshes=False)
    link = model.link_index(reference_link(model))
    first, second = model.link_poses(np.array([[0.3, -1, 1, 0.5, 0.4, 0], [2.0, -1, 1, 0.5, 0.4, 0]]))
    tool = model.link_index("tool0")
    np.testing.assert_allclose(
        se3.inverse(first[link]) @ first[tool], se3.inverse(second[link]) @ second[tool], atol=1e-12
    )
    np.testing.assert_array_equal(posture([0.3, 1, 2]), posture([2.0, 1, 2]))
    with pytest.raises(InputError, match="two joints"):
        reference_link(RobotModel("stick", (), ("foot",)))


def spread(truth, count, rng, rad=0.02, metres=0.03):
    turned = se3.so3_exp(rng.normal(0, rad, (count, 3))) @ truth[:3, :3]
    return se3.make(turned, truth[:3, 3] + rng.normal(0, metres, (count, 3)))


TRUTH = se3.make(se3.so3_exp([1.6, 0.3, -0.2]), [0.6, 0.2, 1.8])


def test_a_third_of_wrong_views_changes_little():
    rng = np.random.default_rng(3)
    poses = spread(TRUTH, 12, rng, 0.001, 0.001)
    poses[:4] = spread(TRUTH, 4, rng, 1.0, 1.0)
    found = combined(poses).parent_T_camera
    assert se3.translation_error_m(TRUTH, found) < 0.003
    assert se3.rotation_error_rad(TRUTH, found) < 0.003


def test_the_order_of_views_and_the_frame_do_not_matter():
    poses = spread(TRUTH, 9, np.random.default_rng(4))
    found, shuffled = combined(poses), combined(poses[::-1])
    np.testing.assert_allclose(found.parent_T_camera, shuffled.parent_T_camera, atol=1e-7)
    turn = se3.so3_exp([0.5, -1.0, 0.3])
    np.testing.assert_allclose(l1_mean(turn @ poses[:, :3, :3]), turn @ l1_mean(poses[:, :3, :3]), atol=1e-7)


def test_the_covariance_is_that_of_views_that_share_an_error():
    normalised, share = [], SHARED_VARIANCE**0.5
    for seed in range(80):
        rng = np.random.default_rng(seed)
        shared = spread(TRUTH, 1, rng, 0.02 * share, 0.03 * share)[0]
        found = combined(spread(shared, 20, rng))
        error = se3.log(TRUTH @ se3.inverse(found.parent_T_camera))
        normalised.append(error @ np.linalg.solve(found.covariance, error))
    assert 4 < np.median(normalised) < 8  # chi-square of 6: 5.3


def test_one_view_is_its_own_answer_without_a_covariance():
    found = combined(TRUTH[None])
    np.testing.assert_allclose(found.parent_T_camera, TRUTH, atol=1e-12)
    assert found.covariance is None
