"""Displacements in the workspace, against their definitions."""

import numpy as np
import pytest

from hecbench import se3
from hecbench.workspace import apart_m, points_in_parent, squared_displacement


def test_the_quadratic_form_is_the_displacement_of_a_small_twist(rng):
    poses = se3.exp(rng.normal(0, 0.5, (5, 6)))
    for camera_moves in (False, True):
        points_m = points_in_parent(poses, camera_moves)
        twist = rng.normal(0, 1e-6, 6)
        X = se3.exp(rng.normal(0, 1, 6))
        expected = float(apart_m(se3.exp(twist) @ X, X, points_m))
        assert np.sqrt(twist @ squared_displacement(points_m) @ twist) == pytest.approx(expected, rel=1e-4)


def test_distances_are_symmetric_and_broadcast(rng):
    poses = se3.exp(rng.normal(0, 0.1, (4, 6)))
    points_m = points_in_parent(poses, False)
    apart = apart_m(poses[:, None], poses, points_m)
    assert apart.shape == (4, 4)
    np.testing.assert_allclose(np.diag(apart), 0, atol=1e-12)


def test_samples_without_a_robot_pose_do_not_count(rng):
    poses = se3.exp(rng.normal(0, 0.5, (5, 6)))
    with_hole = np.concatenate([poses, np.full((1, 4, 4), np.nan)])
    np.testing.assert_array_equal(points_in_parent(with_hole, True), points_in_parent(poses, True))
