"""Laws of rigid transforms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hecbench import se3

twists = arrays(float, 6, elements=st.floats(-1.7, 1.7))
tiny_twists = arrays(float, 6, elements=st.floats(-1e-5, 1e-5))


@given(twists)
def test_log_inverts_exp(twist):
    np.testing.assert_allclose(se3.log(se3.exp(twist)), twist, atol=1e-9)


@given(tiny_twists)
def test_log_inverts_exp_near_identity(twist):
    np.testing.assert_allclose(se3.log(se3.exp(twist)), twist, atol=1e-15)


@given(twists, twists)
def test_inverse_of_product(first, second):
    a, b = se3.exp(first), se3.exp(second)
    np.testing.assert_allclose(se3.inverse(a @ b), se3.inverse(b) @ se3.inverse(a), atol=1e-12)
    np.testing.assert_allclose(a @ se3.inverse(a), np.eye(4), atol=1e-12)


@given(twists, twists)
def test_adjoint_moves_a_twist_to_the_other_frame(frame, twist):
    a_T_b = se3.exp(frame)
    np.testing.assert_allclose(a_T_b @ se3.exp(twist), se3.exp(se3.adjoint(a_T_b) @ twist) @ a_T_b, atol=1e-9)


@given(twists)
def test_left_jacobian_is_the_derivative_of_exp(twist):
    step = 1e-6
    phi = twist[:3]
    numeric = [
        se3.so3_log(se3.so3_exp(phi + step * axis) @ se3.so3_exp(phi - step * axis).T) / (2 * step)
        for axis in np.eye(3)
    ]
    np.testing.assert_allclose(np.transpose(numeric), se3.left_jacobian(phi), atol=1e-6)


@given(twists)
def test_quaternions_round_trip_in_both_orders(twist):
    a_T_b = se3.exp(twist)
    xyzw, wxyz = se3.to_quat_xyzw(a_T_b), se3.to_quat_wxyz(a_T_b)
    np.testing.assert_array_equal(np.roll(xyzw, 1), wxyz)
    np.testing.assert_allclose(se3.from_quat_xyzw(xyzw, a_T_b[:3, 3]), a_T_b, atol=1e-12)
    np.testing.assert_allclose(se3.from_quat_wxyz(wxyz, a_T_b[:3, 3]), a_T_b, atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 1.0, np.pi - 1e-6, np.pi])
def test_rotation_angle_is_accurate_at_both_ends(angle):
    rotation = se3.so3_exp(angle * np.array([2.0, -1.0, 2.0]) / 3.0)
    assert se3.rotation_angle(rotation) == pytest.approx(angle, abs=1e-12, rel=1e-9)


@pytest.mark.parametrize("angle", [1e-150, 1e-9, 1e-4, 1.0, np.pi - 1e-9, np.pi])
def test_rotations_agree_with_scipy(angle, rng):
    from scipy.spatial.transform import Rotation

    rotvecs = rng.normal(size=(50, 3))
    rotvecs *= angle / np.linalg.norm(rotvecs, axis=1, keepdims=True)
    rotations = Rotation.from_rotvec(rotvecs)
    matrices = rotations.as_matrix()
    np.testing.assert_allclose(se3.so3_exp(rotvecs), matrices, atol=1e-15)
    np.testing.assert_allclose(se3.so3_exp(se3.so3_log(matrices)), matrices, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(se3.so3_log(matrices), axis=1), angle, rtol=1e-9)
    spoilt = matrices + rng.normal(0, 1e-4, matrices.shape)
    np.testing.assert_allclose(
        se3.so3_exp(se3.so3_log(spoilt)), Rotation.from_matrix(spoilt).as_matrix(), atol=1e-14
    )
    quaternions = 3 * rotations.as_quat()
    np.testing.assert_allclose(se3.from_quat_xyzw(quaternions, np.zeros(3))[:, :3, :3], matrices, atol=1e-15)


@pytest.mark.parametrize("matrix", [-np.eye(3), np.zeros((3, 3)), np.full((3, 3), np.nan)])
def test_what_is_no_rotation_has_no_logarithm(matrix):
    with pytest.raises((ValueError, np.linalg.LinAlgError)):
        se3.so3_log(matrix)


def test_a_quaternion_of_zero_is_refused():
    with pytest.raises(ValueError, match="zero"):
        se3.from_quat_xyzw(np.zeros(4), np.zeros(3))


def test_vectorised_over_leading_axes(rng):
    stack = rng.normal(size=(2, 3, 6))
    poses = se3.exp(stack)
    assert poses.shape == (2, 3, 4, 4)
    for i in range(2):
        for j in range(3):
            np.testing.assert_allclose(poses[i, j], se3.exp(stack[i, j]), atol=1e-14)
            np.testing.assert_allclose(se3.adjoint(poses)[i, j], se3.adjoint(poses[i, j]), atol=1e-14)


def test_mean_of_symmetric_perturbations_is_the_centre(rng):
    centre = se3.exp(rng.normal(size=6))
    twists = 0.1 * rng.normal(size=(5, 6))
    samples = np.concatenate([centre @ se3.exp(twists), centre @ se3.exp(-twists)])
    assert se3.rotation_error_rad(se3.mean(samples), centre) < 1e-12
    np.testing.assert_allclose(se3.mean(samples)[:3, 3], samples[:, :3, 3].mean(0))


def test_nearest_rotation_is_proper_and_idempotent(rng):
    matrices = rng.normal(size=(50, 3, 3))
    rotations = se3.nearest_rotation(matrices)
    np.testing.assert_allclose(np.linalg.det(rotations), 1.0, atol=1e-12)
    np.testing.assert_allclose(se3.nearest_rotation(rotations), rotations, atol=1e-12)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda T: T * [[1], [1], [1], [2]],
        lambda T: np.diag([1.0, 1, -1, 1]) @ T,
        lambda T: T * np.diag([1.01, 1, 1, 1]).diagonal(),
        lambda T: np.where(np.eye(4) > 0, np.nan, T),
    ],
    ids=["last row", "reflection", "scale", "nan"],
)
def test_is_transform_refuses(spoil, rng):
    good = se3.exp(rng.normal(size=6))
    assert se3.is_transform(good)
    assert not se3.is_transform(spoil(good))


def test_transform_points_and_errors(rng):
    a_T_b, a_T_c = se3.exp(rng.normal(size=(2, 6)))
    points = rng.normal(size=(7, 3))
    expected = (a_T_b @ np.c_[points, np.ones(7)].T).T[:, :3]
    np.testing.assert_allclose(se3.transform_points(a_T_b, points), expected, atol=1e-12)
    assert se3.translation_error_m(a_T_b, a_T_c) == pytest.approx(np.linalg.norm(a_T_b[:3, 3] - a_T_c[:3, 3]))
    assert se3.rotation_error_rad(a_T_b, a_T_b) == 0


@pytest.mark.parametrize("angle", [1e-9, 1e-6, 1e-5, 1e-3, 1.0, 3.0])
def test_left_jacobian_is_the_mean_of_the_rotations_on_the_way(angle):
    phi = angle * np.array([0.6, -0.64, 0.48])
    nodes, weights = np.polynomial.legendre.leggauss(20)
    mean = np.einsum("n,nij->ij", weights / 2, se3.so3_exp((nodes[:, None] + 1) / 2 * phi))
    np.testing.assert_allclose(se3.left_jacobian(phi), mean, atol=1e-13 + 1e-9 * angle**2)


def test_nearest_rotation_is_nearer_than_its_neighbours(rng):
    for matrix in rng.normal(size=(20, 3, 3)):  # half of them are reflections
        nearest = se3.nearest_rotation(matrix)
        distance = np.linalg.norm(matrix - nearest)
        others = np.concatenate(
            [se3.so3_exp(rng.normal(0, 0.1, (50, 3))) @ nearest, se3.so3_exp(rng.normal(0, 2, (50, 3)))]
        )
        assert (np.linalg.norm(matrix - others, axis=(1, 2)) >= distance - 1e-12).all()


@given(twist=twists)
def test_quaternions_have_a_scalar_part_that_is_not_negative(twist):
    assert se3.to_quat_xyzw(se3.exp(twist))[3] >= 0
    assert se3.to_quat_wxyz(se3.exp(twist))[0] >= 0
