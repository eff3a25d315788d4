"""The reconstructed dual-quaternion method: algebra, exactness, half turns, and its least-squares form."""

import numpy as np
import pytest
from hecbench_plugins.markers import dual_quaternions
from hecbench_plugins.markers.hand_eye import pose_pairs
from hecbench_plugins.solvers.wang2024_reconstructed import Method, Wang2024

from hecbench import se3
from hecbench.conformance import rig
from hecbench.errors import Refusal
from hecbench.recording import Mounting

METHODS = list(Method)


def random_poses(rng, count):
    return se3.from_rotvec(rng.uniform(-2, 2, (count, 3)), rng.uniform(-1, 1, (count, 3)))


def test_dual_quaternions_multiply_like_transforms(rng):
    first, second = random_poses(rng, 50), random_poses(rng, 50)
    (p, p_dual), (q, q_dual) = map(dual_quaternions.from_transform, (first, second))
    for a, b, ab, ab_dual in zip(
        first, second, _product(p, q), _dual_product(p, p_dual, q, q_dual), strict=True
    ):
        np.testing.assert_allclose(dual_quaternions.to_transform(ab, ab_dual), a @ b, atol=1e-12)


def _product(p, q):
    left = (dual_quaternions.left_matrix(p) @ q[..., None])[..., 0]
    right = (dual_quaternions.right_matrix(q) @ p[..., None])[..., 0]
    np.testing.assert_allclose(left, right, atol=1e-15)
    return left


def _dual_product(p, p_dual, q, q_dual):
    return _product(p, q_dual) + _product(p_dual, q)


def test_motion_equations_vanish_at_the_solution(exact_rig):
    A, B = pose_pairs(exact_rig).motions
    real, dual = dual_quaternions.from_transform(exact_rig.truth_parent_T_camera)
    np.testing.assert_allclose(
        dual_quaternions.motion_equations(A, B) @ np.concatenate([real, dual]), 0, atol=1e-12
    )


@pytest.mark.parametrize("method", METHODS)
def test_exact_on_any_rig(method, rng):
    """Hand rotations up to 180 deg, any X and Y."""
    for i in range(40):
        recording = rig(np.random.default_rng(i), list(Mounting)[i % 2], rotations=rng.uniform(-3, 3, (8, 3)))
        found = Wang2024(method)(recording.without_truth(), rng=rng).parent_T_camera
        np.testing.assert_allclose(found, recording.truth_parent_T_camera, atol=1e-7)


@pytest.mark.parametrize("method", METHODS)
def test_half_turns_are_left_out(method, rng):
    rotations = np.concatenate([rng.uniform(-0.5, 0.5, (6, 3)), [[0, 0, 0], [0, 0, np.pi], [np.pi, 0, 0]]])
    recording = rig(rng, Mounting.EYE_TO_HAND, rotations=rotations)
    found = Wang2024(method)(recording, rng=rng)
    np.testing.assert_allclose(found.parent_T_camera, recording.truth_parent_T_camera, atol=1e-7)
    assert found.diagnostics["pairs_used"] < found.diagnostics["pairs"]


def test_only_half_turns_are_refused(rng):
    rotations = np.pi * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    with pytest.raises(Refusal, match="half a turn"):
        Wang2024()(rig(rng, Mounting.EYE_TO_HAND, rotations=rotations), rng=rng)


def test_least_squares_is_never_worse_than_the_null_space():
    for seed in range(20):
        recording = rig(np.random.default_rng(seed), list(Mounting)[seed % 2], noise=5e-3)
        equations = dual_quaternions.motion_equations(*pose_pairs(recording).motions).reshape(-1, 8)
        costs = {}
        for method in METHODS:
            found = Wang2024(method)(recording, rng=np.random.default_rng(0)).parent_T_camera
            costs[method] = float(
                ((equations @ np.concatenate(dual_quaternions.from_transform(found))) ** 2).sum()
            )
        assert costs[Method.QCQP] <= costs[Method.NULL_SPACE] * (1 + 1e-9)
