"""The analytic inverse against the forward kinematics, and both against screw axes."""

from math import pi

import numpy as np
import pytest
from hecbench_hardware.kinematics import ARMS, arm_named, wrap

from hecbench import se3
from hecbench.errors import InputError


def product_of_exponentials(arm, joints):
    """base_T_flange from screw axes at the zero pose (Lynch and Park 2017, eq. 4.14), no DH table."""
    (a2, a3), (d1, d4, d5, d6) = arm.a_m, arm.d_m
    reach = a2 + a3
    points = np.array(
        [[0, 0, 0], [0, 0, d1], [a2, 0, d1], [reach, 0, d1], [reach, -d4, d1], [reach, 0, d1 - d5]], float
    )
    axes = np.array([[0, 0, 1], [0, -1, 0], [0, -1, 0], [0, -1, 0], [0, 0, -1], [0, -1, 0]], float)
    base_T_flange = se3.make(se3.so3_exp([pi / 2, 0, 0]), [reach, -d4 - d6, d1 - d5])
    for point, axis, joint in reversed(list(zip(points, axes, joints, strict=True))):
        turn = se3.so3_exp(axis * joint)
        base_T_flange = se3.make(turn, point - turn @ point) @ base_T_flange
    return base_T_flange


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_forward_agrees_with_screw_axes(arm):
    for joints in np.random.default_rng(0).uniform(-pi, pi, (50, 6)):
        assert arm.forward(joints) == pytest.approx(product_of_exponentials(arm, joints), abs=1e-12)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_every_inverse_branch_reaches_the_pose_and_one_is_the_origin(arm):
    for joints in np.random.default_rng(1).uniform(-pi, pi, (200, 6)):
        base_T_flange = arm.forward(joints)
        solutions = arm.inverse(base_T_flange)
        assert 2 <= len(solutions) <= 8
        assert np.abs(arm.forward(solutions) - base_T_flange).max() < 1e-9
        assert np.abs(wrap(solutions - joints)).max(axis=1).min() < 1e-6


def test_branches_differ_and_lie_in_one_turn():
    arm = ARMS["ur5e"]
    solutions = arm.inverse(arm.forward([0.3, -1.2, 1.4, -1.0, -1.5, 0.2]))
    assert len(solutions) == 8
    assert np.abs(solutions).max() <= pi
    gaps = np.abs(wrap(solutions[:, None] - solutions[None])).max(axis=2)[np.triu_indices(8, 1)]
    assert gaps.min() > 1e-3


@pytest.mark.parametrize("joints", [[0.4, -1.2, 1.4, -1.0, 0.0, 0.7], [0.4, -1.2, 0.0, -1.0, 0.9, 0.7]])
def test_singular_poses_are_reached(joints):
    """Wrist aligned, elbow straight."""
    arm = ARMS["ur5e"]
    base_T_flange = arm.forward(joints)
    solutions = arm.inverse(base_T_flange, near_rad=joints)
    assert np.abs(arm.forward(solutions) - base_T_flange).max() < 1e-9
    assert solutions[0] == pytest.approx(joints, abs=1e-6)


def test_near_keeps_full_turns_within_the_range():
    arm = ARMS["ur5e"]
    joints = np.array([0.3 + 2 * pi - 0.5, -1.2, 1.4, -1.0, -1.5, 0.2 - 2 * pi])
    solutions = arm.inverse(arm.forward(joints), near_rad=joints)
    assert solutions[0] == pytest.approx(joints, abs=1e-9)
    assert np.abs(solutions).max() <= arm.joint_range_rad
    steps = np.abs(solutions - joints).max(axis=1)
    assert (np.diff(steps) >= 0).all()


def test_out_of_reach_has_no_solution():
    arm = ARMS["ur5e"]
    assert arm.inverse(se3.make(np.eye(3), [arm.d_m[0] + 2.0, 0, 0.2])).shape == (0, 6)
    assert arm.inverse(se3.make(np.eye(3), [0.0, 0.05, 0.5])).shape == (0, 6)


def test_unknown_arm_lists_the_known_ones():
    with pytest.raises(InputError, match="ur5e"):
        arm_named("ur7")
