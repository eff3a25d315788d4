"""The adjustment: derivatives against finite differences, elimination against the dense system, redundancy."""

from dataclasses import replace

import numpy as np
import pytest

from hecbench import se3
from hecbench.bundle.adjustment import _step, adjust, adjust_with_noise
from hecbench.bundle.model import (
    Noise,
    Problem,
    State,
    _huber_cost,
    _huber_weights,
    linearise,
    predict,
    robot_corrections,
    start,
)
from hecbench.diagnose.fit import IdealCamera
from hecbench.errors import SolverFailure
from hecbench.recording import Mounting

POINTS = np.array([[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0.02]])
NOISE = Noise(0.3, np.deg2rad(0.05), 5e-4)


def problem_and_truth(rng, mounting, samples=10, noise=NOISE):
    X, Y = se3.from_rotvec(rng.uniform(-2, 2, (2, 3)), rng.uniform(-0.3, 0.3, (2, 3)))
    rotvecs, offsets = rng.uniform(-0.5, 0.5, (samples, 3)), rng.uniform(-0.2, 0.2, (samples, 3))
    hand = X @ se3.from_rotvec(rotvecs, np.add(offsets, [0, 0, 1.5])) @ se3.inverse(Y)
    poses = hand if mounting is Mounting.EYE_TO_HAND else se3.inverse(hand)
    problem = Problem(mounting, poses, POINTS, np.zeros((samples, 4, 2)), IdealCamera(1500.0))
    truth = start(problem, X, Y)
    observed = predict(problem, truth)[0]
    observed += rng.normal(0, noise.observed, observed.shape)
    errors = se3.from_rotvec(
        rng.normal(0, noise.rotation_rad, (samples, 3)), rng.normal(0, noise.translation_m, (samples, 3))
    )
    return replace(problem, observed=observed, base_T_flange=poses @ errors), truth


@pytest.fixture(params=list(Mounting))
def mounting(request):
    return request.param


@pytest.mark.parametrize("free_scale", [False, True])
def test_derivatives(mounting, free_scale, rng):
    problem, truth = problem_and_truth(rng, mounting)
    problem = replace(problem, free_scale=free_scale)
    _, _, jacobian = predict(problem, truth)
    count, size = len(problem.observed), jacobian.shape[-1]
    assert size == (13 if free_scale else 12)
    step = 1e-6
    for column in range(size):
        increment = step * np.eye(size)[column]
        ahead = predict(problem, truth.moved(increment, np.zeros((count, 6))))[0]
        behind = predict(problem, truth.moved(-increment, np.zeros((count, 6))))[0]
        np.testing.assert_allclose(jacobian[..., column], (ahead - behind) / (2 * step), atol=1e-4)
    columns = linearise(problem, truth, NOISE).robot_columns
    for column in range(6):
        increment = np.tile(step * np.eye(6)[column], (count, 1))
        ahead = predict(problem, truth.moved(np.zeros(size), increment))[0]
        behind = predict(problem, truth.moved(np.zeros(size), -increment))[0]
        by_robot = (ahead - behind) / (2 * step)
        np.testing.assert_allclose(jacobian[..., columns][..., column], by_robot, atol=1e-4)


def test_gradient_is_the_derivative_of_the_cost(mounting, rng):
    """Far from the minimum too, with Huber's loss active on points and robot poses."""
    problem, truth = problem_and_truth(rng, mounting)
    count = len(problem.observed)
    away = truth.moved(rng.normal(0, 3e-3, 12), rng.normal(0, 3e-3, (count, 6)))
    at = linearise(problem, away, NOISE)
    for _ in range(5):
        shared, robot = rng.normal(0, 1, 12), rng.normal(0, 1, (count, 6))
        step = 1e-7
        ahead = linearise(problem, away.moved(step * shared, step * robot), NOISE).cost
        behind = linearise(problem, away.moved(-step * shared, -step * robot), NOISE).cost
        expected = 2 * (at.gradient_shared @ shared + (at.gradient_robot * robot).sum())
        assert (ahead - behind) / (2 * step) == pytest.approx(expected, rel=1e-4)


def dense(at):
    """All unknowns at once."""
    size, count = len(at.shared), len(at.robot)
    system = np.zeros((size + 6 * count, size + 6 * count))
    system[:size, :size] = at.shared
    for i in range(count):
        rows = slice(size + 6 * i, size + 6 * i + 6)
        system[rows, rows], system[:size, rows], system[rows, :size] = at.robot[i], at.mixed[i], at.mixed[i].T
    return system


def test_elimination_equals_the_dense_system(mounting, rng):
    problem, truth = problem_and_truth(rng, mounting)
    at = linearise(problem, truth, NOISE)
    shared, robot = _step(at, NOISE, 0.0)
    expected = -np.linalg.solve(dense(at), np.concatenate([at.gradient_shared, at.gradient_robot.ravel()]))
    np.testing.assert_allclose(np.concatenate([shared, robot.ravel()]), expected, atol=1e-9)


def test_covariance_and_redundancy(mounting, rng):
    problem, truth = problem_and_truth(rng, mounting)
    solution = adjust(problem, truth, NOISE)
    inverse = np.linalg.inv(dense(solution.at))
    np.testing.assert_allclose(solution.covariance, inverse[:12, :12], rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(solution.robot_covariances[3], inverse[30:36, 30:36], rtol=1e-6, atol=1e-12)
    observations, unknowns = problem.observed.size + 6 * 10, 12 + 6 * 10
    assert solution.redundancy.sum() == pytest.approx(observations - unknowns, rel=1e-6)


def test_start_does_not_matter(mounting, rng):
    problem, truth = problem_and_truth(rng, mounting)
    first = adjust(problem, truth, NOISE)
    again = adjust(problem, truth.moved(rng.normal(0, 0.05, 12), np.zeros((10, 6))), NOISE)
    np.testing.assert_allclose(again.state.parent_T_camera, first.state.parent_T_camera, atol=1e-8)


def test_noise_is_recovered(mounting, rng):
    true = Noise(0.6, np.deg2rad(0.15), 2e-3)
    problem, truth = problem_and_truth(rng, mounting, samples=80, noise=true)
    found = adjust_with_noise(problem, truth, NOISE).noise
    assert found.observed == pytest.approx(true.observed, rel=0.25)
    assert found.rotation_rad == pytest.approx(true.rotation_rad, rel=0.35)
    assert found.translation_m == pytest.approx(true.translation_m, rel=0.25)


def test_known_noise_is_kept(mounting, rng):
    problem, truth = problem_and_truth(rng, mounting)
    assert adjust_with_noise(problem, truth, NOISE, (True, True, True)).noise == NOISE


def test_errors_alike_in_a_sample_do_not_promise_precision(rng):
    """A view that is off as a whole counts as one observation off, not as all its points."""
    points = np.column_stack([rng.uniform(-0.1, 0.1, (40, 2)), np.zeros(40)])
    exact = Noise(1e-9, 1e-9, 1e-9)
    problem, truth = problem_and_truth(rng, Mounting.EYE_TO_HAND, samples=20, noise=exact)
    problem = replace(problem, points_m=points, observed=np.zeros((20, 40, 2)))
    together = rng.normal(0, 1.0, (20, 1, 2))
    observed = predict(problem, truth)[0] + rng.normal(0, 0.1, (20, 40, 2)) + together
    good_arm = Noise(0.3, np.deg2rad(0.005), 5e-5)
    problem = replace(problem, observed=observed)
    found = adjust_with_noise(problem, truth, good_arm, (False, True, True)).noise
    assert found.observed > 1.0


def test_an_outlier_pose_hardly_matters(mounting, rng):
    problem, truth = problem_and_truth(rng, mounting)
    clean = adjust(problem, truth, NOISE).state.parent_T_camera
    poses = problem.base_T_flange.copy()
    poses[4, :3, 3] += [0.0, 0.03, 0.02]
    solution = adjust(replace(problem, base_T_flange=poses), truth, NOISE)
    assert se3.translation_error_m(solution.state.parent_T_camera, clean) < 0.01
    corrected = np.linalg.norm(robot_corrections(poses, solution.state.base_T_flange)[:, 3:], axis=1)
    assert corrected.argmax() == 4


def test_start_behind_the_camera_fails(mounting, rng):
    problem, truth = problem_and_truth(rng, mounting)
    turned = truth.parent_T_camera @ se3.from_rotvec([0, np.pi, 0], [0, 0, 0])
    with pytest.raises(SolverFailure, match="behind the camera"):
        adjust(problem, replace(truth, parent_T_camera=turned), NOISE)


def test_scale_is_found(mounting, rng):
    problem, truth = problem_and_truth(rng, mounting, noise=Noise(1e-9, 1e-12, 1e-12))
    problem = replace(problem, points_m=POINTS / 1.05, free_scale=True)
    solution = adjust(problem, truth, Noise(0.3))
    assert solution.state.scale == pytest.approx(1.05, abs=1e-6)
    assert isinstance(solution.state, State)


@pytest.mark.parametrize("limit", [1.5, 3.0])
def test_the_robust_cost_is_continuous_and_its_weights_are_its_slope(limit):
    norms = np.array([0.2, limit - 1e-7, limit + 1e-7, 10.0])
    costs = [_huber_cost(np.array([norm]), limit) for norm in norms]
    assert costs[1] == pytest.approx(costs[2], abs=1e-5)
    step = 1e-5
    for norm, weight in zip(norms[[0, 3]], _huber_weights(norms[[0, 3]], limit), strict=True):
        slope = (
            _huber_cost(np.array([norm + step]), limit) - _huber_cost(np.array([norm - step]), limit)
        ) / (2 * step)
        assert slope == pytest.approx(2 * weight * norm, rel=1e-6)


def zooming(points, parameters):
    """An ideal camera whose focal length is an unknown, in units of 1500 px."""
    pixels, by_point, _ = IdealCamera(1500.0 * parameters[0])(points, np.zeros(0))
    return pixels, by_point, (pixels / parameters[0])[..., None]


def test_gradient_of_sensor_parameters_with_their_prior(mounting, rng):
    problem, truth = problem_and_truth(rng, mounting)
    known = replace(problem, sensor=zooming, parameters=np.array([1.0]), parameter_sigmas=np.array([1e-3]))
    away = replace(truth, parameters=np.array([1.002]))
    at, step = linearise(known, away, NOISE), 1e-7
    ahead, behind = (
        linearise(known, replace(away, parameters=away.parameters + s), NOISE).cost for s in (step, -step)
    )
    assert (ahead - behind) / (2 * step) == pytest.approx(2 * at.gradient_shared[-1], rel=1e-4)
