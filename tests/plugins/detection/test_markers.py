"""Single markers, grids of them and AprilGrids: where their corners lie, and what a wrong declaration is told."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hecbench_plugins.detection import markers

from hecbench import se3
from hecbench.errors import InputError, TargetNotSeen
from hecbench.targets import AprilGridTarget, ArucoGridTarget, ArucoTarget

K = np.array([[600.0, 0, 319.5], [0, 600.0, 239.5], [0, 0, 1]])
SIZE = 640, 480
TARGETS = [
    ArucoTarget("4X4_50", 3, 0.1),
    ArucoTarget("APRILTAG_36h11", 5, 0.1),
    ArucoGridTarget(4, 3, 0.04, 0.01, "5X5_100"),
    ArucoGridTarget(3, 4, 0.04, 0.008, "6X6_250", 20),
    AprilGridTarget(4, 3, 0.04, 0.3),
    AprilGridTarget(3, 4, 0.04, 0.25, "tag25h9", 10),
]


def pose_of(target, seed=0):
    """Tilted by some 20 degrees, its whole in view."""
    rng = np.random.default_rng(seed)
    R = se3.so3_exp(rng.uniform(-0.35, 0.35, 3))
    if isinstance(target, ArucoTarget | AprilGridTarget):  # their z points to the viewer
        R = R @ np.diag([1.0, -1.0, -1.0])
    return se3.make(R, [0.0, 0.0, 0.36] - R @ target.points_m.mean(0))


def projected(target, camera_T_target):
    points = se3.transform_points(camera_T_target, target.points_m) @ K.T
    return points[:, :2] / points[:, 2:]


@pytest.fixture(scope="module")
def picture(drawn):
    def draw(target, seed=0):
        return drawn(target, K, pose_of(target, seed), SIZE, noise=2.0, rng=np.random.default_rng(seed))

    return draw


@pytest.mark.parametrize("target", TARGETS, ids=lambda target: f"{target.kind}-{target.dictionary}")
def test_corners_have_no_bias(target, picture):
    """Half a pixel, a border of one cell more or less, or another order of corners would show at once."""
    greys = [picture(target, seed) for seed in range(3)]
    found, corners = markers.find(greys, target)
    assert found == target
    off = np.array([seen - projected(target, pose_of(target, seed)) for seed, seen in enumerate(corners)])
    assert np.isfinite(off).mean() > 0.9
    assert np.abs(np.nanmean(off, (0, 1))).max() < 0.02
    assert np.sqrt(np.nanmean(off**2)) < 0.05


def test_the_frame_of_a_grid_is_that_of_opencv():
    target = ArucoGridTarget(4, 3, 0.04, 0.01, "5X5_100", 7)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
    board = cv2.aruco.GridBoard((4, 3), 0.04, 0.01, dictionary, np.arange(7, 19, dtype=np.int32))
    np.testing.assert_allclose(np.concatenate(board.getObjPoints()), target.points_m, atol=1e-8)


def test_the_points_of_an_aprilgrid_are_those_of_kalibr():
    """Its documentation numbers corners 0, 1 along the bottom of the first tag, 2 and 3 along that of the second."""
    points = AprilGridTarget(2, 2, 0.1, 0.3).points_m
    np.testing.assert_allclose(points[[0, 1, 2, 3]], [[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]])
    np.testing.assert_allclose(points[[4, 8]], [[0.13, 0, 0], [0, 0.13, 0]])


def test_an_aprilgrid_with_the_usual_border_is_read_too(picture):
    """As other tools print it: one cell of border, no squares between the tags, and these upside down."""
    printed, declared = ArucoGridTarget(4, 1, 0.04, 0.01, "APRILTAG_36h11"), AprilGridTarget(4, 1, 0.04, 0.25)
    _, (corners,) = markers.find([picture(printed)], declared)
    on_page = declared.points_m * [1, -1, 1] + [0, 0.04, 0]
    expected = se3.transform_points(pose_of(printed), on_page) @ K.T
    np.testing.assert_allclose(corners, expected[:, :2] / expected[:, 2:], atol=0.15)


def test_a_first_id_that_is_seen_is_taken(picture):
    printed = ArucoGridTarget(4, 3, 0.04, 0.01, "5X5_100", 24)
    found, (corners,) = markers.find([picture(printed)], replace(printed, first_id=0))
    assert found == printed
    assert np.isfinite(corners).all()


@pytest.mark.parametrize(
    ("printed", "declared", "message"),
    [
        (TARGETS[2], {"columns": 3, "rows": 4}, "as a grid of 4 columns, not 3"),
        (TARGETS[2], {"gap_m": 0.03}, "measure target.gap_m"),
        (TARGETS[4], {"spacing": 0.6}, "measure target.spacing"),
        (TARGETS[2], {"dictionary": "4X4_250"}, "DICT_5X5_100"),
        (TARGETS[0], {"id": 4}, "correct target.id"),
    ],
)
def test_another_layout_is_named(printed, declared, message, picture):
    with pytest.raises(TargetNotSeen, match=message):
        markers.find([picture(printed)], replace(printed, **declared))


def test_mirrored_pictures_are_named(picture):
    grey = np.ascontiguousarray(picture(TARGETS[2])[:, ::-1])
    with pytest.raises(TargetNotSeen, match="mirrored"):
        markers.find([grey], TARGETS[2])


def test_an_id_seen_twice_is_no_marker(picture):
    grey = np.hstack([picture(TARGETS[0])] * 2)
    with pytest.raises(TargetNotSeen):
        markers.find([grey], TARGETS[0])


def test_an_unknown_dictionary_is_refused(picture):
    with pytest.raises(InputError, match="9X9_50"):
        markers.find([picture(TARGETS[0])], replace(TARGETS[0], dictionary="9X9_50"))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ArucoGridTarget(0, 3, 0.04, 0.01, "4X4_50"), "target.columns: 0"),
        (lambda: ArucoGridTarget(2, 3, 0.04, -0.01, "4X4_50"), "target.gap_m"),
        (lambda: AprilGridTarget(2, 3, 0.04, 0.0), "target.spacing"),
        (lambda: AprilGridTarget(2, 3, 0.04, 0.3, "36h11"), "target.family"),
        (lambda: ArucoTarget("4X4_50", -1, 0.1), "target.id"),
    ],
)
def test_numbers_out_of_range_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()
