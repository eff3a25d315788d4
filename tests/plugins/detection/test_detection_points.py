"""Every detector finds drawn points where they are: no half-pixel offset, and little noise."""

import numpy as np
import pytest
from hecbench_plugins.detection import apriltag, charuco
from hecbench_plugins.detection import chessboard as chessboards
from hecbench_plugins.detection import circles as circle_grids
from hecbench_plugins.detection.pictures import Greys

from hecbench import se3
from hecbench.errors import InputError, TargetNotSeen
from hecbench.lens import project
from hecbench.storage import recording_io
from hecbench.targets import ANY_TAG, AprilTagTarget, CharucoTarget, ChessboardTarget

NO_OFFSET = 0.04


def test_chessboard(draw, chessboard, views, bias):
    target = ChessboardTarget(8, 5, 0.02)
    poses = views(4, [0.07, 0.04])
    found = [chessboards.corners(draw(chessboard(8, 5), 1000, (40, 40), pose), 8, 5) for pose in poses]
    offset, rms = bias([grid[::-1] for grid in found], poses, target.points_m)
    assert np.abs(offset).max() < NO_OFFSET
    assert rms < 0.1


def test_the_first_square_of_an_odd_board_is_light(draw, chessboard, views):
    pattern = chessboard(8, 5)
    pose = views(1, [0.07, 0.04])[0]
    upright = chessboards.corners(draw(pattern, 1000, (40, 40), pose), 8, 5)
    turned = chessboards.corners(draw(pattern[::-1, ::-1], 1000, (40, 40), pose), 8, 5)
    assert np.linalg.norm(upright[0] - turned[-1]) < 0.5


def test_a_board_that_is_cut_off_is_not_found_a_row_too_far(drawn, camera):
    target = ChessboardTarget(7, 5, 0.03)
    for cut in range(12):
        pose = se3.from_rotvec([0.05, 0.1, 0.15], [0.02 + 0.012 * cut, -0.05, 0.6])
        grey = drawn(target, camera.K, pose, (camera.width, camera.height))
        found = chessboards.corners(grey, 7, 5)
        if found is None:
            continue
        expected = project(camera, se3.transform_points(pose, target.points_m))
        apart = min(np.linalg.norm(found - order, axis=1).max() for order in (expected, expected[::-1]))
        assert apart < 1.0, cut


@pytest.mark.parametrize("marked", [True, False])
def test_circles(draw, circles, views, bias, marked):
    target = ChessboardTarget(7, 5, 0.02)
    poses = views(3, [0.06, 0.04])
    found = [circle_grids.centres(draw(circles(7, 5, marked), 2000, (40, 40), pose), 7, 5) for pose in poses]
    assert all(grid[1] == marked for grid in found)
    grids = [
        grid[0] if marked or grid[0][0] @ [1, 1] < grid[0][-1] @ [1, 1] else grid[0][::-1] for grid in found
    ]
    offset, rms = bias(grids, poses, target.points_m)
    assert np.abs(offset).max() < NO_OFFSET
    assert rms < 0.1


@pytest.fixture(scope="module")
def tag_pattern():
    """Tag 10 of tag36h11, 50 px a bit, black border 8 x 8 bits; OpenCV keeps it upside down."""
    import cv2

    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    marker = cv2.aruco.generateImageMarker(dictionary, 10, 400)[::-1, ::-1]
    return np.pad(marker, 50, constant_values=255)


def test_apriltag(draw, tag_pattern, views, bias):
    target = AprilTagTarget("tag36h11", 10, 0.1)
    poses = views(4, [0.0, 0.0])
    found = [apriltag.tags(draw(tag_pattern, 4000, (250, 250), pose), "tag36h11")[10] for pose in poses]
    offset, rms = bias(found, poses, target.points_m)
    assert np.abs(offset).max() < NO_OFFSET
    assert rms < 0.2


def test_the_photos_of_the_library_agree(shared):
    """The corners that the library's own test expects, pixel centres at half integers there."""
    from PIL import Image

    folder = shared / "data" / "apriltag_photos"
    matched = 0
    for file in sorted(folder.glob("*.txt")):
        grey = np.asarray(Image.open(next(folder.glob(f"{file.stem}.jpg"))).convert("L"))
        found = apriltag.sightings(grey, "tag36h11")
        assert (
            apriltag.tags(grey, "tag36h11") == {}
        )  # robots that all carry id 0: no one of them is the target
        for line in file.read_text().splitlines():
            numbers = np.array(line.replace("(", "").replace(")", "").replace(",", " ").split(), float)
            expected = numbers[1:].reshape(4, 2) - 0.5
            distances = [np.linalg.norm(tag - expected, axis=1).max() for tag in found[int(numbers[0])]]
            matched += min(distances) < 1
    assert matched >= 3


def test_the_only_tag_is_taken_and_other_ids_are_named(draw, tag_pattern, views):
    grey = draw(tag_pattern, 4000, (250, 250), views(1, [0.0, 0.0])[0])
    target, found = apriltag.find([grey, None], AprilTagTarget("tag36h11", ANY_TAG, 0.1))
    assert (target.id, found[1]) == (10, None)
    with pytest.raises(InputError, match=r"expected id 3 of tag36h11 in 1 images, seen: 10 \(1x\)"):
        apriltag.find([grey], AprilTagTarget("tag36h11", 3, 0.1))
    with pytest.raises(InputError, match=r"target\.family: 'tag99'"):
        apriltag.find([grey], AprilTagTarget("tag99", 3, 0.1))


@pytest.fixture(scope="module")
def charuco_pattern():
    """A ChArUco board of 7 x 6 squares, 60 px each, in either layout."""
    import cv2

    def make(legacy, columns=7, rows=6):
        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
        board = cv2.aruco.CharucoBoard((columns, rows), 0.03, 0.022, dictionary)
        board.setLegacyPattern(legacy)
        return np.pad(board.generateImage((60 * columns, 60 * rows)), 30, constant_values=255)

    return make


@pytest.mark.parametrize("printed", [True, False])
@pytest.mark.parametrize("declared", [True, False])
def test_the_printed_charuco_layout_is_found(draw, charuco_pattern, views, bias, printed, declared):
    poses = views(2, [0.105, 0.09])
    greys = [draw(charuco_pattern(printed), 2000, (30, 30), pose) for pose in poses]
    target, found = charuco.find(greys, CharucoTarget(7, 6, 0.03, 0.022, "DICT_5X5_100", declared))
    assert target.legacy is printed
    offset, rms = bias(found, poses, target.points_m)
    assert np.abs(offset).max() < NO_OFFSET
    assert rms < 0.12


def test_a_partly_hidden_charuco_board_gives_the_corners_in_view(draw, charuco_pattern, views, bias):
    poses = views(2, [0.105, 0.09])
    greys = [draw(charuco_pattern(False), 2000, (30, 30), pose) for pose in poses]
    for grey in greys:
        grey[:, 250:] = 128
    target, found = charuco.find(greys, CharucoTarget(7, 6, 0.03, 0.022, "5X5_100"))
    counts = [np.isfinite(corners[:, 0]).sum() for corners in found]
    assert all(4 <= count < 30 for count in counts)
    assert bias(found, poses, target.points_m)[1] < 0.3


def test_the_printed_dictionary_is_named(draw, charuco_pattern, views):
    grey = draw(charuco_pattern(False), 2000, (30, 30), views(1, [0.105, 0.09])[0])
    with pytest.raises(InputError, match=r"markers of DICT_5X5_\d+, not DICT_4X4_50"):
        charuco.find([grey], CharucoTarget(7, 6, 0.03, 0.022, "DICT_4X4_50"))
    with pytest.raises(InputError, match="'5x5' is not one of DICT_4X4_100"):
        charuco.find([grey], CharucoTarget(7, 6, 0.03, 0.022, "5x5"))


def test_a_board_declared_with_columns_and_rows_exchanged_is_named(shared):
    recording = recording_io.load(shared / "cases" / "marker" / "charuco_swapped")
    with pytest.raises(TargetNotSeen, match="columns and rows are exchanged"):
        charuco.find(list(Greys(recording)), recording.target)


def test_markers_numbered_from_another_id_and_mirrored_pictures():
    import cv2

    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_100)
    board = cv2.aruco.CharucoBoard((7, 5), 0.03, 0.022, dictionary, np.arange(24, 41, dtype=np.int32))
    grey = board.generateImage((700, 500), marginSize=20)
    target = CharucoTarget(7, 5, 0.03, 0.022, "DICT_4X4_100")
    _, (corners,) = charuco.find([grey], target)
    assert np.isfinite(corners).all()
    with pytest.raises(TargetNotSeen, match="mirrored"):
        charuco.find([np.ascontiguousarray(grey[:, ::-1])], target)
