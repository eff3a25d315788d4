"""Recordings in memory: what they hold, derive and refuse."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from hecbench import se3
from hecbench.errors import InputError, Refusal
from hecbench.recording import CameraModel, Mounting, Recording
from hecbench.specs import Need
from hecbench.targets import AprilTagTarget, CharucoTarget, ChessboardTarget, PointsTarget


def test_hand_poses_close_the_loop(exact_rig):
    """camera_T_target = inverse(X) H Y with one Y, for both mountings."""
    X = exact_rig.truth_parent_T_camera
    Y = se3.inverse(exact_rig.hand_poses()) @ X @ exact_rig.camera_T_target
    np.testing.assert_allclose(Y, np.broadcast_to(Y[0], Y.shape), atol=1e-12)


def test_parent_link_follows_the_mounting(exact_rig):
    assert exact_rig.parent_link == ("base" if exact_rig.mounting is Mounting.EYE_TO_HAND else "flange")


def test_offers(exact_rig):
    assert exact_rig.offers() == {Need.TARGET_POSES, Need.CORNERS, Need.INTRINSICS, Need.INITIAL}
    assert Need.TARGET_POSES not in replace(exact_rig, camera_T_target=None, corners_px=None).offers()


def test_subset_takes_samples_in_order(exact_rig):
    part = exact_rig.subset([4, 1])
    assert part.sample_ids == (exact_rig.sample_ids[4], exact_rig.sample_ids[1])
    np.testing.assert_array_equal(part.base_T_flange, exact_rig.base_T_flange[[4, 1]])
    np.testing.assert_array_equal(part.corners_px, exact_rig.corners_px[[4, 1]])


def test_digest_sees_content_and_nothing_else(exact_rig):
    assert replace(exact_rig).sha256 == exact_rig.sha256
    assert exact_rig.without_truth().sha256 != exact_rig.sha256
    moved = exact_rig.base_T_flange.copy()
    moved[0, 0, 3] += 1e-9
    assert replace(exact_rig, base_T_flange=moved).sha256 != exact_rig.sha256


def test_rounded_rotations_are_accepted_and_repaired(exact_rig):
    rounded = replace(exact_rig, base_T_flange=np.round(exact_rig.base_T_flange, 4))
    assert se3.is_transform(rounded.base_T_flange, 1e-12).all()


def _with(recording, name, index, value):
    array = getattr(recording, name).copy()
    array[index] = value
    return replace(recording, **{name: array})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda r: replace(r, sample_ids=()), "at least one"),
        (lambda r: replace(r, sample_ids=("a",) * len(r)), "same id"),
        (lambda r: _with(r, "base_T_flange", (2, 0, 0), 2.0), r"samples\[2\].base_T_flange: is not a rigid"),
        (lambda r: _with(r, "base_T_flange", (2, 0, 0), np.nan), r"samples\[2\].base_T_flange.*finite"),
        (lambda r: _with(r, "camera_T_target", 1, np.diag([1.0, 1, -1, 1])), r"samples\[1\].camera_T_target"),
        (lambda r: replace(r, base_T_flange=r.base_T_flange[:-1]), "row per sample"),
        (lambda r: _with(r, "base_T_flange", 3, np.nan), r"samples\[3\].*neither"),
        (lambda r: replace(r, corners_px=r.corners_px[:, :-1]), "row per target point"),
        (lambda r: _with(r, "corners_px", (0, 0, 0), np.nan), "corners_px.*finite"),
        (lambda r: replace(r, target=None), "describe the target"),
        (lambda r: replace(r, truth_parent_T_camera=np.eye(3)), "truth_parent_T_camera"),
        (lambda r: replace(r, images=(None,)), "images: 1 for"),
        (lambda r: replace(r, camera=CameraModel(10, 10, np.eye(3))), "identity"),
        (lambda r: replace(r, camera=CameraModel(0, 10)), "not positive"),
        (lambda r: replace(r, camera=CameraModel(10, 10, None, np.zeros(3))), "camera.distortion: 3"),
        (lambda r: replace(r, camera=CameraModel(10, 10, np.diag([-1.0, 1, 1]))), "fx, fy > 0"),
        (lambda r: replace(r, target=ChessboardTarget(6, 5, -1)), "positive length"),
        (lambda r: replace(r, target=CharucoTarget(6, 5, 0.03, 0.04, "DICT_4X4_50")), "must be smaller"),
        (lambda r: replace(r, target=ChessboardTarget(1, 5, 0.1)), "columns: 1 is not within 2"),
        (lambda r: replace(r, target=PointsTarget(())), "points_m"),
    ],
)
def test_faults_are_named(exact_rig, change, message):
    with pytest.raises(InputError, match=message):
        change(exact_rig)


def test_without_robot_poses_hand_poses_are_refused(exact_rig):
    joints_only = replace(exact_rig, base_T_flange=None, joints_rad=np.zeros((len(exact_rig), 6)))
    with pytest.raises(Refusal, match="base_T_flange"):
        joints_only.hand_poses()


def test_images_are_decoded_when_asked_for(tmp_path):
    picture = np.random.default_rng(0).integers(0, 255, (30, 40, 3), dtype=np.uint8)
    Image.fromarray(picture).save(tmp_path / "a.png")
    (tmp_path / "bad.png").write_bytes((tmp_path / "a.png").read_bytes()[:100])
    recording = Recording(
        name="images",
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=tuple("abcd"),
        camera=CameraModel(40, 30),
        joints_rad=np.zeros((4, 6)),
        images=(tmp_path / "a.png", tmp_path / "bad.png", None, picture[:20]),
        masks=(None, None, None, np.full((30, 40), 200, np.uint8)),
    )
    np.testing.assert_array_equal(recording.image(0), picture)
    assert recording.mask(3).all()
    with pytest.raises(InputError, match=r"bad.png: cannot be read as an image"):
        recording.image(1)
    with pytest.raises(InputError, match=r"samples\[2\].image: there is none"):
        recording.image(2)
    with pytest.raises(InputError, match="40x20 px, but the camera is 40x30"):
        recording.image(3)


def test_target_points():
    board = ChessboardTarget(3, 2, 0.1).points_m
    np.testing.assert_allclose(
        board, [[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0], [0, 0.1, 0], [0.1, 0.1, 0], [0.2, 0.1, 0]]
    )
    assert CharucoTarget(4, 3, 0.1, 0.07, "DICT_4X4_50").points_m.shape == (6, 3)
    tag = AprilTagTarget("tag36h11", 0, 0.2).points_m
    np.testing.assert_allclose(tag[:, :2], [[-0.1, 0.1], [0.1, 0.1], [0.1, -0.1], [-0.1, -0.1]])
    assert not PointsTarget.of([[0, 0, 0], [1, 0, 0.5]]).is_planar


def test_present_gives_what_there_is_and_refuses_the_rest_by_name(exact_rig):
    assert exact_rig.present.camera is exact_rig.camera
    assert exact_rig.present.camera.intrinsics is exact_rig.camera.K
    bare = replace(exact_rig, camera=None, corners_px=None)
    with pytest.raises(Refusal, match=f"recording '{exact_rig.name}' has no camera"):
        _ = bare.present.camera
    with pytest.raises(AttributeError, match="not_a_field"):
        _ = bare.present.not_a_field
    with pytest.raises(Refusal, match="K is not known"):
        _ = replace(exact_rig.camera, K=None).intrinsics
