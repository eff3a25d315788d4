"""Limits along the path: what is refused, and that nothing slips between the samples."""

import numpy as np
import pytest
from hecbench_hardware.kinematics import ARMS
from hecbench_hardware.limits import (
    Box,
    Limits,
    Sphere,
    check_path,
    joint_path,
    line_speed_m_s,
    linear_path,
    link_points,
    load_limits,
    motion_time_s,
    six_joints,
)

from hecbench import se3
from hecbench.errors import InputError

ARM = ARMS["ur5e"]
PAN = np.eye(6)[0]
"""One radian of the first joint."""


def test_path_keeps_its_ends_and_its_step():
    start, end = np.zeros(6), np.array([1.0, -0.5, 0.2, 0, 0, 3.0])
    path = joint_path(start, end)
    assert np.array_equal(path[0], start)
    assert np.array_equal(path[-1], end)
    assert np.abs(np.diff(path, axis=0)).sum(axis=1).max() <= 0.02 + 1e-12


def test_linear_path_stays_on_the_line(ready_pose):
    start = ARM.forward(ready_pose)
    target = se3.make(se3.so3_exp([0, 0, 0.4]) @ start[:3, :3], start[:3, 3] + [0.1, 0.1, 0.05])
    path = linear_path(ARM, ready_pose, target)
    poses = ARM.forward(path)
    assert poses[-1] == pytest.approx(target, abs=1e-9)
    direction = (target - start)[:3, 3] / np.linalg.norm((target - start)[:3, 3])
    offsets = poses[:, :3, 3] - start[:3, 3]
    assert np.abs(offsets - np.outer(offsets @ direction, direction)).max() < 1e-9


def test_a_line_is_slowed_until_no_joint_is_too_fast(ready_pose):
    target = ARM.forward(ready_pose).copy()
    target[:3, 3] += [0.1, 0.1, 0.05]
    path = linear_path(ARM, ready_pose, target)
    speed = line_speed_m_s(path, 0.15, 0.5)
    fastest = np.abs(np.diff(path, axis=0)).max() / (0.15 / (len(path) - 1) / speed)
    assert fastest == pytest.approx(0.5)
    assert line_speed_m_s(path, 0.0, 0.5) == np.inf
    assert line_speed_m_s(ready_pose[None].repeat(2, 0), 0.1, 0.5) == np.inf


def test_linear_path_refuses_a_singularity():
    joints = np.array([0.0, -1.2, 1.6, -1.9708, -1.5708, 0.0])
    start = ARM.forward(joints)
    mirrored = start.copy()
    mirrored[:2, 3] *= -1
    with pytest.raises(InputError, match=r"singularity|out of reach"):
        linear_path(ARM, joints, mirrored)


def test_a_thin_wall_between_two_free_poses_is_found(ready_pose):
    """Thinner than the distance between two samples of the path."""
    end = ready_pose + 0.8 * PAN
    middle = ARM.forward(ready_pose + 0.4 * PAN)[:3, 3]
    half = np.array([0.0005, 0.0005, 0.1])
    wall = Box(tuple(middle - half), tuple(middle + half))
    limits = Limits(keep_out=(wall,), tool=(Sphere((0, 0, 0), 1e-6),), arm_radius_m=1e-6)
    check_path(ARM, ready_pose[None], limits)
    check_path(ARM, end[None], limits)
    with pytest.raises(InputError, match="keep-out box"):
        check_path(ARM, joint_path(ready_pose, end), limits)


def test_the_arm_itself_counts(ready_pose):
    elbow = link_points(ARM.link_frames(ready_pose[None]))[0, 6]
    box = Box(tuple(elbow - 0.01), tuple(elbow + 0.01))
    with pytest.raises(InputError, match="the arm enters"):
        check_path(ARM, ready_pose[None], Limits(keep_out=(box,)))


def test_every_pose_of_a_path_counts_for_the_joint_range(ready_pose):
    limits = Limits(joint_upper_rad=(0.5, 7, 7, 7, 7, 7))
    path = joint_path(ready_pose, ready_pose + 0.4 * PAN)
    with pytest.raises(InputError, match="joint 1 at"):
        check_path(ARM, path, limits)


def test_six_joints():
    assert six_joints([0, 1, 2, 3, 4, 5]).dtype == float
    for wrong in ([1, 2], [[0] * 6], [0, 0, 0, 0, 0, float("inf")]):
        with pytest.raises(InputError, match="six joint angles"):
            six_joints(wrong)


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        ('{"joint_speed_rad_s": -1}', "must be positive"),
        ('{"speed": 1}', "unknown limit 'speed'"),
        ('{"workspace": {"lower_m": [0,0,1], "upper_m": [1,1,0]}}', "is empty"),
        ('{"joint_lower_rad": [0,0,0,0,0,9]}', "must lie below"),
        ('{"tool": [{"centre_m": [0,0], "radius_m": 0.1}]}', "tool"),
        ("{", "limits.json"),
        ("[1]", "limits.json"),
    ],
)
def test_bad_limit_files_are_refused_in_one_line(tmp_path, content, complaint):
    path = tmp_path / "limits.json"
    path.write_text(content)
    with pytest.raises(InputError, match=complaint) as caught:
        load_limits(path)
    assert "\n" not in str(caught.value)


def test_limit_files_fill_in_defaults(tmp_path):
    path = tmp_path / "limits.json"
    path.write_text('{"tool_speed_m_s": 0.1, "keep_out": [{"lower_m": [0,0,0], "upper_m": [1,1,1]}]}')
    limits = load_limits(path)
    assert limits.tool_speed_m_s == 0.1
    assert limits.keep_out == (Box((0, 0, 0), (1, 1, 1)),)
    assert limits.joint_speed_rad_s == Limits().joint_speed_rad_s


@pytest.mark.parametrize(("length", "expected_s"), [(0.0, 0.0), (0.25, 1.0), (1.0, 2.5)])
def test_motion_time(length, expected_s):
    """Triangular below the top speed, trapezoidal above."""
    assert motion_time_s(length, 0.5, 1.0) == pytest.approx(expected_s)
