"""From images to corners: the real sets, ambiguous boards, unknown intrinsics, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_plugins.detection import detect, overlay, write_overlays
from hecbench_plugins.markers.target_poses import project, target_poses

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import CameraModel, Mounting, Recording
from hecbench.registry import load
from hecbench.specs import DatasetSpec, Kind
from hecbench.storage import recording_io
from hecbench.targets import ChessboardTarget, PointsTarget

X = se3.from_rotvec([0.2, -0.3, 1.5], [0.05, -0.03, 0.04])
Y = se3.from_rotvec([2.9, 0.2, 0.1], [0.5, 0.1, 0.0])


@pytest.fixture(scope="module")
def real(shared):
    """A real set as its adapter reads it."""

    def read(folder, adapter):
        return load().get(Kind.DATASET, adapter, DatasetSpec).load(shared / "data" / folder)

    return read


@pytest.fixture
def taken(camera, draw):
    """An eye-in-hand recording of a drawn pattern, without corners."""

    def make(pattern, px_per_m, target, poses, given=camera):
        hand = X @ poses @ se3.inverse(Y)
        return Recording(
            name="drawn",
            mounting=Mounting.EYE_IN_HAND,
            sample_ids=tuple(map(str, range(len(poses)))),
            camera=given,
            target=target,
            base_T_flange=se3.inverse(hand),
            images=tuple(np.stack([draw(pattern, px_per_m, (40, 40), pose)] * 3, -1) for pose in poses),
        )

    return make


def reprojection_px(recording):
    poses = target_poses(recording)
    gaps = [
        project(recording.camera, pose, recording.target.points_m) - corners
        for pose, corners in zip(poses, recording.corners_px, strict=True)
    ]
    return float(np.sqrt((np.array(gaps) ** 2).sum(2).mean()))


def spread(recording):
    """Spread (deg, mm) of the constant target pose by OpenCV's Park, and its answer."""
    import cv2

    flange_T_base, poses = se3.inverse(recording.hand_poses()), target_poses(recording)
    R, t = cv2.calibrateHandEye(
        flange_T_base[:, :3, :3],
        flange_T_base[:, :3, 3],
        poses[:, :3, :3],
        poses[:, :3, 3],
        method=cv2.CALIB_HAND_EYE_PARK,
    )
    answer = se3.make(R, t[:, 0])
    constant = flange_T_base @ answer @ poses
    mean = se3.mean(constant)
    angles, distances = se3.rotation_error_rad(mean, constant), se3.translation_error_m(mean, constant)
    return np.rad2deg(np.sqrt(np.mean(angles**2))), 1e3 * np.sqrt(np.mean(distances**2)), answer


def test_visp_chessboard_on_the_hand_side(real):
    found = detect(real("visp_franka/data-eye-in-hand", "visp"))
    assert "chessboard found in 8 of 8 images" in found.notes[0]
    rotation_deg, translation_mm, answer = spread(found)
    assert (rotation_deg, translation_mm) == pytest.approx((0.45, 4.4), rel=0.05)
    published = se3.from_rotvec([0.00178253, 0.00917657, 1.581782], [0.057715, -0.033926, -0.042274])
    assert 1e3 * se3.translation_error_m(published, answer) < 0.3
    assert reprojection_px(found) < 0.45


def test_visp_tag_with_the_intrinsics_of_its_tutorial(real):
    recording = real("visp_franka/data-eye-to-hand", "visp")
    K = np.array([[601.0670, 0, 321.3921], [0, 602.4187, 236.8026], [0, 0, 1]])
    found = detect(replace(recording, camera=CameraModel(640, 480, K, np.array([0.056637, 0, 0, 0]))))
    assert (found.target.id, "its id is 10" in found.notes[0]) == (10, True)
    rotation_deg, translation_mm, answer = spread(found)
    assert (rotation_deg, translation_mm) == pytest.approx((0.51, 1.7), rel=0.05)
    assert 1e3 * np.linalg.norm(answer[:3, 3] - [0.954036, -0.051236, 0.476220]) < 0.5


def test_industrial_circles_with_nominal_and_refitted_intrinsics(real):
    recording = real("industrial_10x10/test_set_10x10", "industrial")
    nominal = detect(recording)
    assert spread(nominal)[:2] == pytest.approx((2.74, 19), rel=0.1)
    assert not nominal.notes[0].endswith("demands")
    refitted = detect(recording, refit_intrinsics=True)
    rotation_deg, translation_mm, _ = spread(refitted)
    assert rotation_deg < 1.01
    assert translation_mm == pytest.approx(7.3, rel=0.1)
    assert reprojection_px(refitted) < 0.2


def test_the_corners_of_the_ur3e_are_found_again(shared):
    recording = recording_io.load(shared / "data" / "ur3e_cam1").subset([0, 11, 22, 33])
    found = detect(replace(recording, corners_px=None))
    turned = found.corners_px[:, ::-1]
    gaps = [np.linalg.norm(c - recording.corners_px, axis=2) for c in (found.corners_px, turned)]
    best = min(gaps, key=np.max)
    assert np.sqrt((best**2).mean()) < 0.3


def test_a_board_that_looks_alike_upside_down_is_turned_by_the_hand_motion(taken, chessboard, views, camera):
    target = ChessboardTarget(7, 5, 0.02)
    poses = views(8, [0.06, 0.04], roll=3.0)
    found = detect(taken(chessboard(7, 5), 1000, target, poses))
    assert "boards turned, as the hand motion demands" in found.notes[0]
    expected = np.array([project(camera, pose, target.points_m) for pose in poses])
    gaps = [np.abs(corners - expected).max() for corners in (found.corners_px, found.corners_px[:, ::-1])]
    assert min(gaps) < 1


def test_a_square_grid_of_equal_dots_is_turned_by_the_hand_motion(taken, circles, views, camera):
    target = PointsTarget.of(ChessboardTarget(5, 5, 0.02).points_m)
    poses = views(7, [0.04, 0.04], roll=3.0)
    found = detect(taken(circles(5, 5), 2000, target, poses))
    expected = np.array([project(camera, pose, target.points_m) for pose in poses]).reshape(-1, 5, 5, 2)
    grids = found.corners_px.reshape(-1, 5, 5, 2)
    gaps = [np.abs(np.rot90(grids, k, axes=(1, 2)) - expected).max() for k in range(4)]
    assert min(gaps) < 1


def test_without_robot_motion_the_open_end_is_said(taken, chessboard, views):
    poses = views(2, [0.06, 0.04])
    found = detect(taken(chessboard(7, 5), 1000, ChessboardTarget(7, 5, 0.02), poses))
    assert "which end of the board is first stays open" in found.notes[0]


def test_unknown_intrinsics_come_from_the_same_images(taken, chessboard, views, camera):
    target = ChessboardTarget(8, 5, 0.02)
    unknown = CameraModel(camera.width, camera.height)
    found = detect(taken(chessboard(8, 5), 1000, target, views(10, [0.07, 0.04]), unknown))
    np.testing.assert_allclose(found.camera.K, camera.K, rtol=0.01, atol=3)
    assert reprojection_px(found) < 0.1
    assert "intrinsics calibrated from 10 images" in found.notes[0]


def test_a_missing_picture_is_a_sample_without_corners(taken, chessboard, views):
    recording = taken(chessboard(8, 5), 1000, ChessboardTarget(8, 5, 0.02), views(3, [0.07, 0.04]))
    found = detect(replace(recording, images=(None, *recording.images[1:])))
    assert np.isnan(found.corners_px[0]).all()
    assert np.isfinite(found.corners_px[1:]).all()


def test_overlays_show_the_points(taken, chessboard, views, tmp_path):
    recording = taken(chessboard(8, 5), 1000, ChessboardTarget(8, 5, 0.02), views(2, [0.07, 0.04]))
    found = detect(recording)
    picture = overlay(found, 0)
    u, v = np.rint(found.corners_px[0, 0]).astype(int)
    ring = picture[v - 9 : v + 10, u - 9 : u + 10].astype(int)
    assert (ring[..., 0] - ring[..., 2] > 100).any()
    np.testing.assert_array_equal(recording.image(0), found.image(0))
    assert [path.name for path in write_overlays(found, tmp_path)] == ["0.png", "1.png"]


def test_what_cannot_be_detected_is_refused(taken, chessboard, views):
    recording = taken(chessboard(8, 5), 1000, ChessboardTarget(8, 5, 0.02), views(2, [0.07, 0.04]))
    faults = [
        (replace(recording, images=None), "has no images"),
        (replace(recording, target=None), "what target its images show"),
        (replace(recording, target=ChessboardTarget(4, 3, 0.02)), "no image shows the chessboard"),
        (replace(recording, target=PointsTarget.of(np.eye(3))), "form no flat grid"),
        (replace(recording, camera=CameraModel(480, 360)), "calibrating it takes 3"),
        (replace(recording, camera=CameraModel(640, 480)), "is 480x360 px, but the camera is 640x480"),
    ]
    for faulty, message in faults:
        with pytest.raises(InputError, match=message):
            detect(faulty)


def test_views_that_do_not_determine_the_camera_are_refused(taken, chessboard):
    flat = se3.make(np.eye(3), np.array([[-0.07, -0.04, z] for z in (0.4, 0.41, 0.42)]))
    recording = taken(chessboard(8, 5), 1000, ChessboardTarget(8, 5, 0.02), flat, CameraModel(480, 360))
    with pytest.raises(InputError, match="tilt the target"):
        detect(recording)
