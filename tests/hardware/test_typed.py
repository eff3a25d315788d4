"""Poses that a person types: read as they are written, or refused in words."""

import numpy as np
import pytest
from hecbench_hardware.kinematics import ARMS
from hecbench_hardware.robots.typed import TypedRobot, open_typed

from hecbench import se3
from hecbench.errors import InputError

POSE = se3.from_rotvec([0.2, -0.4, 0.9], [0.3, -0.2, 0.5])


@pytest.mark.parametrize(
    ("text", "convention", "unit", "degrees"),
    [
        ("p[0.3, -0.2, 0.5, 0.2, -0.4, 0.9]", "ur", "m", False),
        ("300 -200 500 0.2 -0.4 0.9", "rotvec", "mm", False),
        ("300; -200; 500; {A}; {B}; {C}", "kuka", "mm", True),
        ("0.3 -0.2 0.5 {x} {y} {z} {w}", "quat_xyzw", "m", False),
    ],
)
def test_what_pendants_show(text, convention, unit, degrees):
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_matrix(POSE[:3, :3])
    names = dict(zip("ABC", turn.as_euler("ZYX", degrees=True), strict=True))
    names |= dict(zip("xyzw", turn.as_quat(), strict=True))
    robot = TypedRobot()
    robot.type(text.format(**names), convention, unit, degrees)
    np.testing.assert_allclose(robot.settle().base_T_flange, POSE, atol=1e-9)
    assert np.isnan(robot.state().joints_rad).all()


def test_small_angles_in_degrees_are_degrees():
    robot = TypedRobot()
    robot.type("0 0 0 0 0 3", "rotvec", "m", degrees=True)
    np.testing.assert_allclose(
        robot.state().base_T_flange[:3, :3], se3.so3_exp(np.deg2rad([0, 0, 3.0])), atol=1e-12
    )


def test_joints_need_the_model():
    robot = open_typed({"arm": "ur5e"})
    robot.type("0 -90 90 -90 -90 0", "joints", degrees=True)
    expected = ARMS["ur5e"].forward(np.deg2rad([0, -90, 90, -90, -90, 0]))
    np.testing.assert_allclose(robot.state().base_T_flange, expected, atol=1e-12)
    with pytest.raises(InputError, match=r"robot\.arm"):
        TypedRobot().type("0 0 0 0 0 0", "joints")


@pytest.mark.parametrize(
    ("text", "convention", "said"),
    [
        ("", "ur", "no finite numbers"),
        ("1 2 x", "ur", "more than numbers"),
        ("0 0 0 1 1", "ur", "a pose of 5 numbers"),
        ("0 0 0 0 0 0", "quat_xyzw", "does not fit"),
        ("0 0 0 2 0 0 0", "quat_xyzw", "unit length"),
        ("0 0 nan 0 0 0", "ur", "no finite numbers"),
    ],
)
def test_what_is_no_pose_is_refused(text, convention, said):
    with pytest.raises(InputError, match=said):
        TypedRobot().type(text, convention)


def test_it_is_never_moved():
    robot = TypedRobot()
    for act in (robot.enable, lambda: robot.move_joints(np.zeros(6)), lambda: robot.move_linear(np.eye(4))):
        with pytest.raises(InputError, match="cannot be moved from here"):
            act()
    with pytest.raises(InputError, match=r"robot\.arm=ur6"):
        open_typed({"arm": "ur6"})
