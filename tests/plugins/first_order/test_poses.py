"""Derivatives of the pose's numbers against finite differences, and the poses that they stand for."""

import numpy as np
import pytest
from hecbench_plugins.first_order.poses import EulerAngles, Increment, LogVector

from hecbench import se3

START = se3.make(se3.so3_exp([1.2, -1.1, 1.3]), [0.1, 0.3, 2.0])


@pytest.mark.parametrize("numbers", [Increment(START), LogVector(START), EulerAngles(START)])
def test_start_is_the_given_pose(numbers):
    np.testing.assert_allclose(numbers.pose(*numbers.start), START, atol=1e-12)


@pytest.mark.parametrize("numbers", [Increment(START), LogVector(START), EulerAngles(START)])
@pytest.mark.parametrize("size", [0.0, 1e-6, 0.3])
def test_pull_is_the_derivative(numbers, size, rng):
    points, weights = rng.normal(size=(20, 3)), rng.normal(size=(20, 3))
    at = numbers.start.reshape(-1) + size * rng.normal(size=6)

    def loss(values):
        return float((weights * se3.transform_points(numbers.pose(values[:3], values[3:]), points)).sum())

    seen = se3.transform_points(numbers.pose(at[:3], at[3:]), points)
    left = np.concatenate([np.cross(seen, weights).sum(0), weights.sum(0)])
    step = 1e-6 * np.eye(6)
    expected = [(loss(at + d) - loss(at - d)) / 2e-6 for d in step]
    np.testing.assert_allclose(np.concatenate(numbers.pull(at[:3], at[3:], left)), expected, atol=1e-6)


def test_increment_turns_about_the_origin_of_the_parent():
    turned = Increment(START).pose(np.zeros(3), np.array([0.1, 0.2, -0.3]))
    np.testing.assert_allclose(turned[:3, 3], START[:3, 3])
    np.testing.assert_allclose(turned[:3, :3], se3.so3_exp([0.1, 0.2, -0.3]) @ START[:3, :3], atol=1e-12)


def test_log_vector_is_the_logarithm():
    w, u = np.split(se3.log(START), 2)
    np.testing.assert_allclose(LogVector(START).start, [u, w])
    np.testing.assert_allclose(LogVector(START).pose(2 * u, 2 * w), se3.exp(2 * np.r_[w, u]), atol=1e-9)
