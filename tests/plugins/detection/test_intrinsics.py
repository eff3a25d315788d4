"""Intrinsics from pictures: honest about what the views determine, and no lens that they do not show."""

import numpy as np
import pytest
from hecbench_plugins.detection.intrinsics import LENSES, calibrate

from hecbench import se3
from hecbench.errors import InputError

cv2 = pytest.importorskip("cv2", reason="calibrating a camera needs OpenCV")

WIDTH, HEIGHT, FOCAL_PX, NOISE_PX = 1280, 720, 1000.0, 0.15
BOARD = np.array([[0.03 * x, 0.03 * y, 0.0] for y in range(6) for x in range(9)]) - [0.12, 0.075, 0]
LENS = np.array([-0.12, 0.05, 6e-4, -4e-4, 0.0])


def photographed(rng, views, tilt_deg, aside, lens=LENS, turn=0.5):
    """Corners (N, P, 2) of a board tilted up to `tilt_deg` and up to `aside` half pictures off the middle; K, lens."""
    K = np.array([[FOCAL_PX * rng.uniform(0.9, 1.1), 0, WIDTH / 2], [0, 0, HEIGHT / 2], [0, 0, 1]])
    K[1, 1] = K[0, 0] * rng.uniform(0.998, 1.002)
    K[:2, 2] += rng.normal(0, 0.012 * WIDTH, 2)
    lens = lens * rng.uniform(0.6, 1.4, 5)
    corners = []
    while len(corners) < views:
        rotvec = np.r_[rng.uniform(-1, 1, 2) * np.deg2rad(tilt_deg), rng.uniform(-turn, turn)]
        depth = rng.uniform(0.5, 0.9)
        half = np.array([WIDTH, HEIGHT]) / 2 / FOCAL_PX
        shift = np.r_[rng.uniform(-aside, aside, 2) * half, 1] * depth
        seen = cv2.projectPoints(BOARD, cv2.Rodrigues(se3.so3_exp(rotvec))[0], shift, K, lens)[0][:, 0]
        if (seen > 0).all() and (seen < [WIDTH, HEIGHT]).all():
            corners.append(seen + rng.normal(0, NOISE_PX, seen.shape))
    return np.array(corners), K, lens


def centred(K):
    return np.r_[K[0, 0], K[1, 1], K[0, 2], K[1, 2]]


SCENES = {
    "many": (25, 35, 0.7),
    "ten": (10, 35, 0.6),
    "frontal": (15, 9, 0.3),
    "in the middle": (12, 25, 0.1),
}


@pytest.mark.parametrize("scene", SCENES)
def test_the_sigmas_are_honest(scene):
    within = []
    for seed in range(6):
        corners, K, _ = photographed(np.random.default_rng([41, seed]), *SCENES[scene])
        found = calibrate(BOARD, corners, (WIDTH, HEIGHT))
        within.append(np.abs(centred(found.camera.K) - centred(K)) < 3 * found.sigmas[:4])
    assert np.mean(within) >= 0.95


def test_no_term_that_the_views_do_not_show():
    """With all terms some of these sets give a k3 of several units."""
    largest = []
    for seed in range(6):
        corners, _, _ = photographed(np.random.default_rng([42, seed]), 8, 20, 0.1)
        found = calibrate(BOARD, corners, (WIDTH, HEIGHT))
        free = cv2.calibrateCamera(
            [BOARD.astype(np.float32)] * len(corners), corners.astype(np.float32), (WIDTH, HEIGHT), None, None
        )[2]
        largest.append((abs(found.camera.distortion[4]), abs(free.ravel()[4])))
    ours, theirs = np.median(largest, 0)
    assert ours < 0.1 * theirs


def test_a_strong_lens_gets_its_terms():
    lens = np.array([-0.4, 0.2, 2e-3, 1e-3, -0.05])
    corners, _, true = photographed(np.random.default_rng(43), 25, 35, 0.7, lens)
    found = calibrate(BOARD, corners, (WIDTH, HEIGHT))
    assert set(LENSES[-2]) <= set(found.lens)
    np.testing.assert_allclose(found.camera.distortion[:2], true[:2], atol=0.05)


def test_everything_is_said():
    corners, _, _ = photographed(np.random.default_rng(44), *SCENES["many"])
    found = calibrate(BOARD, corners, (WIDTH, HEIGHT))
    text = str(found)
    for term in ("fx", "fy", "cx", "cy", *found.lens):
        assert f" {term} " in text, text
    assert text.count("+-") == 4 + len(found.lens)
    assert f"cover {100 * found.coverage:.0f} % of the picture" in text
    assert 0.3 < found.coverage < 1
    assert np.deg2rad(30) < found.tilt_rad < np.deg2rad(100)


def test_pictures_of_one_pose_count_once():
    rng = np.random.default_rng(45)
    corners, _, _ = photographed(rng, 10, 35, 0.6)
    repeated = np.concatenate(
        [corners, *(corners + rng.normal(0, NOISE_PX, corners.shape) for _ in range(3))]
    )
    found, once = (calibrate(BOARD, views, (WIDTH, HEIGHT)) for views in (repeated, corners))
    assert found.images == 10
    np.testing.assert_allclose(found.sigmas, once.sigmas, rtol=1e-3)
    with pytest.raises(InputError, match="2 images from different poses"):
        calibrate(BOARD, np.repeat(corners[:2], 5, 0), (WIDTH, HEIGHT))


def test_views_that_are_alike_are_refused():
    corners, _, _ = photographed(np.random.default_rng(46), 5, 2, 0.3)
    with pytest.raises(InputError, match=r"within .* degrees of each other.*tilt the target"):
        calibrate(BOARD, corners, (WIDTH, HEIGHT))


@pytest.mark.parametrize("noise_px", [3.0, 8.0])
def test_a_centre_or_focal_length_that_stays_open_is_refused(noise_px):
    rng = np.random.default_rng(47)
    corners, _, _ = photographed(rng, 4, 9, 0.05)
    with pytest.raises(InputError, match=r"leave the (focal length|centre) at .* \+- .* px; tilt the target"):
        calibrate(BOARD, corners + rng.normal(0, noise_px, corners.shape), (WIDTH, HEIGHT))
