"""The pose of a drawn tag: exact within its covariance; every picture that cannot be trusted is refused."""

import cv2
import numpy as np
import pytest
from hecbench_hardware import tag_edges, tags
from hecbench_hardware.tag_edges import TagRefused

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import CameraModel
from hecbench.system import apriltags
from hecbench.targets import AprilTagTarget

TAG = AprilTagTarget("tag36h11", 0, 0.12)
CAMERA = CameraModel(640, 480, np.array([[600.0, 0, 325], [0, 610, 236], [0, 0, 1]]))
POSE = se3.from_rotvec([0.5, -0.4, 0.2], [0.05, 0.02, 0.9])
_FINE, _CELL_PX = 4, 40


def drawn(camera_T_tag=POSE, target=TAG, camera=CAMERA, onto=None):
    """A picture of the tag, each pixel the mean of 16, on grey or onto another picture."""
    white = np.pad(tag_edges.cells(target.family, target.id), 1, constant_values=True)
    texture = np.kron(np.where(white, 230, 20).astype(np.uint8), np.ones((_CELL_PX, _CELL_PX), np.uint8))
    cell_m = target.size_m / (len(white) - 2)
    to_metres = np.array([[cell_m / _CELL_PX, 0, 0], [0, cell_m / _CELL_PX, 0], [0, 0, 1.0]])
    to_metres[:2, 2] = (0.5 / _CELL_PX - len(white) / 2) * cell_m
    K = camera.K.copy()
    K[:2] *= _FINE
    K[:2, 2] += (_FINE - 1) / 2
    homography = K @ camera_T_tag[:3, [0, 1, 3]] @ to_metres
    size = camera.width * _FINE, camera.height * _FINE
    canvas = np.full((camera.height, camera.width), 120, np.uint8) if onto is None else onto
    fine = cv2.resize(canvas, size, interpolation=cv2.INTER_NEAREST)
    fine = cv2.warpPerspective(texture, homography, size, dst=fine, borderMode=cv2.BORDER_TRANSPARENT)
    return cv2.resize(fine, (camera.width, camera.height), interpolation=cv2.INTER_AREA)


def test_pose_is_exact_and_better_than_the_corners_alone(rng):
    errors, corners_alone = [], []
    for _ in range(6):
        truth = se3.from_rotvec(
            rng.uniform(-0.6, 0.6, 3), [*rng.uniform(-0.15, 0.15, 2), rng.uniform(0.7, 1.2)]
        )
        found = tags.locate(drawn(truth), CAMERA, TAG)
        errors.append(se3.translation_error_m(found.camera_T_tag, truth))
        rough = tags.planar_solutions(found.corners_px, CAMERA, TAG)
        corners_alone.append(min(se3.translation_error_m(pose, truth) for pose in rough))
    assert np.median(errors) < 1e-3
    assert np.median(errors) < np.median(corners_alone)


def test_true_pose_lies_within_the_covariance(rng):
    squares = []
    for _ in range(12):
        truth = se3.from_rotvec(rng.uniform(-0.6, 0.6, 3), [*rng.uniform(-0.1, 0.1, 2), 0.8])
        noisy = drawn(truth) + rng.normal(0, 2.0, (480, 640))
        found = tags.locate(np.clip(np.rint(noisy), 0, 255).astype(np.uint8), CAMERA, TAG)
        twist = se3.log(truth @ se3.inverse(found.camera_T_tag))
        squares.append(twist @ np.linalg.solve(found.covariance, twist))
    assert np.quantile(squares, 0.8) < 12.6  # the 95 % quantile of chi-squared with 6 degrees of freedom
    assert np.median(squares) > 0.3


def test_colour_and_distortion_are_understood():
    camera = CameraModel(640, 480, CAMERA.K, np.array([-0.2, 0.05, 0.001, 0.001, 0.0]))
    u, v = np.meshgrid(np.arange(640.0), np.arange(480.0))
    pixels = np.stack([u, v], -1).reshape(-1, 1, 2)
    places = cv2.undistortPoints(pixels, camera.K, camera.distortion, P=camera.K).reshape(480, 640, 2)
    straight = drawn()
    bent = cv2.remap(straight, *places.astype(np.float32).transpose(2, 0, 1), cv2.INTER_LINEAR)
    found = tags.locate(np.repeat(bent[..., None], 3, axis=2), camera, TAG)
    assert se3.translation_error_m(found.camera_T_tag, POSE) < 1.5e-3


def test_official_orientation_is_x_right_y_down_z_into_the_tag():
    upright = se3.make(np.eye(3), [0.0, 0.0, 0.6])
    found = tags.locate(drawn(upright), CAMERA, TAG)
    assert se3.rotation_error_rad(found.camera_T_tag, upright) < 0.01


def test_small_distant_tag_has_two_poses_and_says_so():
    truth = se3.from_rotvec([0.12, 0.0, 0.0], [0.1, 0.1, 2.5])
    found = tags.locate(
        drawn(truth, AprilTagTarget("tag36h11", 0, 0.2)), CAMERA, AprilTagTarget("tag36h11", 0, 0.2)
    )
    assert found.other is not None
    assert found.other[1] >= found.error_px


def noise(rng=None):
    return np.random.default_rng(0).integers(100, 140, (480, 640)).astype(np.uint8)


@pytest.mark.parametrize(
    ("picture", "target", "reason"),
    [
        (noise, TAG, "is not in the picture: uncover it"),
        (lambda: drawn(), AprilTagTarget("tag36h11", 7, 0.12), "but tag36h11 id 0: name the right tag"),
        (lambda: drawn(), AprilTagTarget("tag25h9", 0, 0.12), "but tag36h11 id 0: name the right tag"),
        (
            lambda: drawn(
                se3.make(np.eye(3), [-0.15, 0, 0.8]), onto=drawn(se3.make(np.eye(3), [0.15, 0, 0.8]))
            ),
            TAG,
            "2 tags have id 0",
        ),
        (lambda: drawn(se3.make(np.eye(3), [-325 / 600 * 0.8 + 0.067, 0, 0.8])), TAG, "touches the edge"),
        (lambda: cv2.GaussianBlur(drawn(), None, 3.2), TAG, "blurred"),
    ],
    ids=["absent", "wrong id", "wrong family", "twice", "clipped", "blurred"],
)  # fmt: skip
def test_untrustworthy_picture_is_refused_with_the_cure(picture, target, reason):
    with pytest.raises(TagRefused, match=reason):
        tags.locate(picture(), CAMERA, target)


@pytest.mark.parametrize("size", [(1, 1), (2, 2), (1000, 3), (3, 1000), (8, 8)])
def test_picture_too_small_for_a_tag_shows_none(size):
    camera = CameraModel(*size, CAMERA.K)
    with pytest.raises(TagRefused, match="not in the picture"):
        tags.locate(np.zeros((*size[::-1], 3), np.uint8), camera, TAG)


@pytest.mark.parametrize("picture", [np.zeros((480, 640, 4), np.uint8), np.zeros((480, 640), np.float32)])
def test_picture_of_another_kind_is_bad_input(picture):
    with pytest.raises(InputError, match="RGB"):
        tags.locate(picture, CAMERA, TAG)


def test_wrong_camera_is_bad_input():
    with pytest.raises(InputError, match="640x480"):
        tags.locate(drawn(), CameraModel(320, 240, CAMERA.K), TAG)
    with pytest.raises(InputError, match="intrinsics"):
        tags.locate(drawn(), CameraModel(640, 480), TAG)
    with pytest.raises(InputError, match="tag36h11"):
        tags.locate(drawn(), CAMERA, AprilTagTarget("tag99", 0, 0.12))


@pytest.mark.parametrize(
    ("name", "fx", "fy", "cx", "cy"),
    [
        ("test_image.png", 336.7756, 336.0273, 333.3576, 212.7738),
        ("test_image_rotation_40.png", 329.8730, 332.9461, 528.0, 396.0),
    ],
)
def test_real_pictures_agree_with_the_pose_of_the_detection_library(shared, name, fx, fy, cx, cy):
    picture = cv2.imread(str(shared / "data" / "pupil_tags" / name), cv2.IMREAD_GRAYSCALE)
    detector = apriltags.detector("tag36h11", 2.0, 0)
    theirs = detector.detect(picture, estimate_tag_pose=True, camera_params=(fx, fy, cx, cy), tag_size=0.065)[
        0
    ]
    K = np.array([[fx, 0, cx - 0.5], [0, fy, cy - 0.5], [0, 0, 1]])
    camera = CameraModel(picture.shape[1], picture.shape[0], K)
    found = tags.locate(picture, camera, AprilTagTarget("tag36h11", theirs.tag_id, 0.065))
    distance = np.linalg.norm(theirs.pose_t)
    assert np.linalg.norm(found.camera_T_tag[:3, 3] - theirs.pose_t[:, 0]) < 0.02 * distance
    assert found.error_px < 1.0
