"""Every way of writing pose numbers down is read back, and what cannot be known is refused."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hecbench import se3
from hecbench.errors import InputError
from hecbench.exchange.conventions import prove
from hecbench.exchange.pose_numbers import pose_conventions
from hecbench.exchange.stillness import stillness
from hecbench.recording import Mounting

BOTH = tuple(Mounting)
ROBOT, TARGET = ("base", "flange"), ("camera", "target")


@pytest.fixture(params=BOTH)
def poses(request):
    """A generated cell: mounting, base_T_flange and camera_T_target (12, 4, 4), with 0.2 deg and 0.5 mm noise."""
    rng = np.random.default_rng(5)
    X = se3.from_rotvec([0.3, -2.0, 1.1], [0.9, 0.2, 0.6])
    camera_T_target = se3.from_rotvec(rng.normal(0, 0.5, (12, 3)), rng.normal([0, 0, 0.8], 0.15, (12, 3)))
    Y = se3.from_rotvec([0.1, 0.4, -0.2], [0.05, 0.02, 0.1])
    hand = X @ camera_T_target @ se3.inverse(Y)
    noisy = se3.exp(rng.normal(0, 1, (12, 6)) * np.repeat([np.deg2rad(0.2), 5e-4], 3)) @ camera_T_target
    return request.param, hand if request.param is Mounting.EYE_TO_HAND else se3.inverse(hand), noisy


def quaternion(base_T_flange, order="xyzw"):
    write = se3.to_quat_xyzw if order == "xyzw" else se3.to_quat_wxyz
    return np.hstack([base_T_flange[:, :3, 3], write(base_T_flange)])


def streams(robot, target):
    return pose_conventions(robot, ROBOT), pose_conventions(target, TARGET)


def check(proof, poses, atol=1e-9):
    mounting, base_T_flange, camera_T_target = poses
    assert proof.mounting is mounting
    np.testing.assert_allclose(proof.base_T_flange, base_T_flange, atol=atol)
    np.testing.assert_allclose(proof.camera_T_target, camera_T_target, atol=atol)


def test_the_mounting_is_proven_when_the_directions_are_documented(poses):
    _, robot, target = poses
    proof = prove("x", *streams(robot, target), BOTH)
    check(proof, poses)
    assert str(poses[0]) in proof.note


def test_a_swapped_quaternion_order_is_named(poses):
    mounting, robot, target = poses
    robot_readings = pose_conventions(quaternion(robot, "wxyz"), ROBOT, assumed_rotation="quat_xyzw")
    proof = prove("x", robot_readings, pose_conventions(target, TARGET), [mounting])
    check(proof, poses)
    assert "quat_wxyz" in proof.note
    assert "documented reading does not" in proof.note


@pytest.mark.parametrize("order", ["XYZ", "ZYX", "ZYZ", "YXZ", "xyz", "zyx", "zxz", "yxy"])
def test_the_euler_order_in_degrees_and_millimetres_is_found(poses, order):
    mounting, robot, target = poses
    angles = Rotation.from_matrix(robot[:, :3, :3]).as_euler(order, degrees=True)
    rows = np.hstack([1e3 * robot[:, :3, 3], angles])
    proof = prove("x", *streams(rows, target), [mounting])
    check(proof, poses, 1e-6)
    assert f"euler_{order} in mm" in proof.note


@pytest.mark.parametrize("unit", ["m", "mm"])
def test_rotation_vectors_and_units(poses, unit):
    mounting, robot, target = poses
    rows = np.hstack([robot[:, :3, 3] * {"m": 1, "mm": 1e3}[unit], se3.so3_log(robot[:, :3, :3])])
    proof = prove("x", *streams(rows, target), [mounting])
    check(proof, poses)
    assert f"rotvec in {unit}" in proof.note


def test_column_major_matrices_are_recognised(poses):
    mounting, robot, target = poses
    rows = np.swapaxes(robot, 1, 2).reshape(-1, 16)
    check(prove("x", *streams(rows, target), [mounting]), poses)


def test_inverted_robot_poses_stay_ambiguous_and_both_cures_are_listed(poses):
    mounting, robot, target = poses
    other = next(m for m in BOTH if m is not mounting)
    with pytest.raises(InputError, match="equally still") as caught:
        prove("x", *streams(se3.inverse(robot), target), [mounting])
    assert f"{mounting}, flange_T_base" in str(caught.value)
    assert f"{other}, base_T_flange" in str(caught.value)


def test_inverted_robot_poses_are_read_when_the_user_vouches_for_the_mounting(poses):
    mounting, robot, target = poses
    proof = prove(
        "x",
        pose_conventions(se3.inverse(robot), ROBOT),
        pose_conventions(target, TARGET),
        [mounting],
        mounting_given=True,
    )
    check(proof, poses)
    assert "flange_T_base" in proof.note


def test_what_the_user_says_is_the_only_thing_tried(poses):
    _, robot, _ = poses
    given = pose_conventions(quaternion(robot), ROBOT, rotation="quat_wxyz", inverted=False, unit="m")
    assert [reading.text for reading in given] == ["base_T_flange quat_wxyz in m"]


def test_undocumented_and_inconsistent_is_refused_with_the_best_readings(poses):
    _, robot, target = poses
    rows = np.hstack([robot[:, :3, 3], se3.so3_log(robot[:, :3, :3])])
    with pytest.raises(InputError, match="no reading holds the target still"):
        prove("x", *streams(rows, np.roll(target, 4, 0)), BOTH)


def test_documented_but_mixed_up_pairs_are_kept_and_said(poses):
    mounting, robot, target = poses
    proof = prove("x", *streams(robot, np.roll(target, 4, 0)), [mounting])
    assert "pairs mixed up" in proof.note


def test_four_samples_prove_nothing(poses):
    mounting, robot, target = poses
    proof = prove("x", pose_conventions(robot[:4], ROBOT), pose_conventions(target[:4], TARGET), [mounting])
    assert "too few samples" in proof.note
    with pytest.raises(InputError, match="4 samples cannot tell 2 possible readings apart"):
        prove("x", pose_conventions(robot[:4], ROBOT), pose_conventions(target[:4], TARGET), BOTH)


@pytest.mark.parametrize("most_deg", [15, 60])
def test_six_noisy_samples_of_any_cell_are_enough(most_deg):
    rng = np.random.default_rng(8)
    for mounting in BOTH * 4:
        X, Y = se3.from_rotvec(rng.normal(0, 1.5, (2, 3)), rng.normal(0, 0.5, (2, 3)))
        axes = rng.normal(size=(6, 3))
        axes /= np.linalg.norm(axes, axis=1, keepdims=True)
        turns = axes * np.deg2rad(rng.uniform(0, most_deg, (6, 1)))
        target = se3.from_rotvec(turns, rng.normal([0, 0, 0.8], 0.08, (6, 3)))
        target = target @ se3.from_rotvec(rng.normal(0, 1.5, 3), np.zeros(3))
        hand = X @ target @ se3.inverse(Y)
        robot = hand if mounting is Mounting.EYE_TO_HAND else se3.inverse(hand)
        noise = rng.normal(0, 1, (6, 6)) * np.repeat([np.deg2rad(0.3), 1e-3], 3)
        noisy = se3.exp(noise) @ target
        check(
            prove("x", *streams(robot, noisy), BOTH),
            (mounting, robot, noisy),
        )
        swapped = pose_conventions(quaternion(robot, "wxyz"), ROBOT, assumed_rotation="quat_xyzw")
        check(prove("x", swapped, pose_conventions(noisy, TARGET), [mounting]), (mounting, robot, noisy))


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (np.ones((4, 5)), "a pose of 5 numbers"),
        (np.ones((4, 7)), "not of unit length"),
        (np.tile(np.arange(16.0), (4, 1)), "proper rotation"),
    ],
)
def test_numbers_that_are_no_poses_are_refused(rows, message):
    with pytest.raises(InputError, match=message):
        pose_conventions(rows, ROBOT)


def test_a_rotation_of_the_wrong_length_is_refused():
    with pytest.raises(InputError, match="does not fit 4 numbers"):
        pose_conventions(np.tile([0, 0, 0, 0, 0, 0, 1.0], (3, 1)), ROBOT, rotation="rotvec")


def test_different_counts_are_refused(poses):
    mounting, robot, target = poses
    with pytest.raises(InputError, match="12 robot poses for 11 target poses"):
        prove("x", pose_conventions(robot, ROBOT), pose_conventions(target[:-1], TARGET), [mounting])


def test_exact_data_are_perfectly_still(exact_rig):
    still = stillness(exact_rig.hand_poses(), exact_rig.camera_T_target)
    assert still.rotation_deg < 1e-5
    assert still.translation_mm < 1e-6
