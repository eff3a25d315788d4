"""Which joints to look at next: information by finite differences, choices by exhaustion, and who cannot be planned."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_datasets.suites import synthetic

from hecbench import next_view, se3
from hecbench.errors import InputError
from hecbench.estimate import Estimate
from hecbench.rendering import Renderer
from hecbench.workspace import cube_corners


@pytest.fixture(scope="module")
def recording():
    return synthetic.make("LP", 0, 2)


@pytest.fixture(scope="module")
def view(recording):
    return next_view.RobotView(recording)


@pytest.fixture
def candidates(rng):
    return np.deg2rad(synthetic.CENTRE_JOINTS_DEG + rng.uniform(-60, 60, (12, 6)))


def test_information_is_that_of_the_contours_motion(recording):
    """The area swept when the camera turns is the integral of the motion along the normal over the contour."""
    model, mesh = synthetic.robot_and_mesh()
    truth = se3.inverse(recording.truth_parent_T_camera)
    poses = truth @ model.link_poses(recording.joints_rad, frame=synthetic.BASE)[0]
    renderer = Renderer(mesh, recording.camera.K, 640, 480)
    turn_rad = 3e-3

    def drawn(twist):
        renderer.draw(se3.exp(twist) @ poses)
        information, length_px = next_view.contour_information(renderer)
        return renderer.face.copy() >= 0, information, length_px

    mask, information, length_px = drawn(np.zeros(6))
    np.testing.assert_allclose(information, information.T, rtol=1e-9)
    assert np.linalg.eigvalsh(information)[0] > 0
    edges = (mask[1:] != mask[:-1]).sum(), (mask[:, 1:] != mask[:, :-1]).sum()
    assert max(edges) < length_px < sum(edges)
    swept_px2 = (drawn(np.array([turn_rad, 0, 0, 0, 0, 0]))[0] ^ mask).sum()
    rms_px = np.sqrt(information[0, 0] * next_view.CONTOUR_NOISE_PX**2 * next_view.CORRELATION_PX / length_px)
    mean_px = swept_px2 / (length_px * turn_rad)
    assert 0.6 * rms_px < mean_px < rms_px


def test_choices_are_the_best_of_all(recording, view, candidates):
    camera = recording.truth_parent_T_camera
    everything = next_view.Visible(0.0, 0.0)
    known = next_view.prior_information()
    choice = next_view.most_informative(view, camera, candidates, known, 3, everything)
    looks = [view.look(joints, camera) for joints in candidates]
    left = list(range(len(candidates)))
    for index in choice.indices:
        determinants = [np.linalg.det(known + looks[i].information) for i in left]
        assert left[int(np.argmax(determinants))] == index
        left.remove(index)
        known = known + looks[index].information
    np.testing.assert_allclose(choice.known, known)
    np.testing.assert_array_equal(choice.joints_rad, candidates[choice.indices])


def test_planned_views_are_expected_to_tell_more_than_random_ones(recording, view, candidates, rng):
    camera = recording.truth_parent_T_camera
    points_m = cube_corners(recording.base_T_flange)
    everything = next_view.Visible(0.0, 0.0)
    first = view.look(recording.joints_rad[0], camera)
    known = next_view.prior_information() + first.information
    now = next_view.expected_error_m(known, camera, points_m)
    planned = next_view.most_informative(view, camera, candidates, known, 2, everything)
    varied = next_view.most_uncertain(view, camera, candidates, known, 2, everything, rng=rng)
    at_random = []
    for pair in (rng.choice(12, 2, replace=False) for _ in range(10)):
        added = sum(view.look(candidates[i], camera).information for i in pair)
        at_random.append(next_view.expected_error_m(known + added, camera, points_m))
    for choice in (planned, varied):
        then = next_view.expected_error_m(choice.known, camera, points_m)
        assert then < np.mean(at_random) < now


def test_mask_variance_is_zero_for_one_camera_and_grows_with_their_spread(recording, view, rng):
    camera, joints = recording.truth_parent_T_camera, recording.joints_rad[0]
    assert next_view.mask_variance(view, joints, np.array([camera] * 3)) == 0
    near, far = (
        np.array([camera @ se3.exp(s * rng.normal(size=6)) for _ in range(5)]) for s in (0.005, 0.03)
    )
    assert 0 < next_view.mask_variance(view, joints, near) < next_view.mask_variance(view, joints, far)


def test_mask_variance_is_the_unbiased_one(recording, view, rng):
    camera, joints = recording.truth_parent_T_camera, recording.joints_rad[0]
    cameras = np.array([camera @ se3.exp(0.02 * rng.normal(size=6)) for _ in range(4)])
    masks = np.array([view.masks(joints, one[None])[0] for one in cameras], float)
    assert next_view.mask_variance(view, joints, cameras) == pytest.approx(masks.var(0, ddof=1).sum())


def test_possible_cameras_move_the_contour_as_far_as_a_mask_can_show(recording, view, rng):
    camera = recording.truth_parent_T_camera
    look = view.look(recording.joints_rad[0], camera)
    cameras = next_view.possible_cameras(1e4 * look.information, camera, look, 200, rng)
    twists = se3.log(se3.inverse(cameras) @ camera)
    scale = next_view.CONTOUR_NOISE_PX**2 * next_view.CORRELATION_PX / look.contour_px
    motion_px = np.sqrt(np.einsum("ni,ij,nj->n", twists, look.information, twists).mean() * scale)
    assert motion_px == pytest.approx(next_view.SPREAD_PX, rel=0.15)


def test_expected_error_of_a_pure_shift(recording):
    known = np.diag([1e12] * 3 + [1e4] * 3)
    error_m = next_view.expected_error_m(known, recording.truth_parent_T_camera, np.zeros((1, 3)))
    assert error_m == pytest.approx(np.sqrt(3) * 0.01, rel=1e-3)


def test_what_an_estimate_knows_is_its_covariance_seen_from_the_camera(recording):
    camera = recording.truth_parent_T_camera
    seen = np.diag([1.0, 2, 3, 4, 5, 6])
    carried = se3.adjoint(camera)
    estimate = Estimate(camera, covariance=carried @ np.linalg.inv(seen) @ carried.T)
    np.testing.assert_allclose(next_view.information_of(estimate), seen, atol=1e-9)
    with pytest.raises(InputError, match="no covariance"):
        next_view.information_of(Estimate(camera))


def test_the_robot_out_of_view_does_not_count(recording, view, candidates):
    camera = recording.truth_parent_T_camera
    inside = view.look(recording.joints_rad[0], camera)
    assert inside.in_view == 1
    assert 0.02 < inside.filled < 0.3
    aside = camera @ se3.make(se3.so3_exp([0, 0.5, 0]), np.zeros(3))
    assert view.look(recording.joints_rad[0], aside).in_view < 0.6
    away = camera @ np.diag([-1.0, 1, -1, 1])
    assert view.look(recording.joints_rad[0], away).in_view == 0
    with pytest.raises(InputError, match="only 0 of 12 candidate poses"):
        next_view.most_informative(view, away, candidates, next_view.prior_information())


@pytest.mark.parametrize("missing", ["robot", "camera"])
def test_what_is_needed_is_named(recording, missing):
    with pytest.raises(InputError, match=missing):
        next_view.RobotView(replace(recording, **{missing: None}))
