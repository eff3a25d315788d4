"""Pictures drawn exactly: every pixel is the mean of the pattern over its square, pixel centres at integers."""

import numpy as np
import pytest
from hecbench_plugins.printing.seen import seen

from hecbench import se3
from hecbench.recording import CameraModel

SAMPLES_PER_SIDE = 4


@pytest.fixture(scope="session")
def camera():
    return CameraModel(480, 360, np.array([[450.0, 0, 239.3], [0, 455.0, 181.7], [0, 0, 1]]))


@pytest.fixture(scope="session")
def views():
    """camera_T_target of a target whose middle (m) is looked at from several sides, 0.4 m away."""

    def make(count, middle_m, roll=0.8, seed=2):
        rng = np.random.default_rng(seed)
        turns = rng.uniform([-0.5, -0.5, -roll], [0.5, 0.5, roll], (count, 3))
        positions = rng.uniform([-0.02, -0.015, 0.38], [0.02, 0.015, 0.45], (count, 3))
        camera_T_middle = se3.from_rotvec(turns, positions)
        return camera_T_middle @ se3.make(np.eye(3), [-middle_m[0], -middle_m[1], 0])

    return make


@pytest.fixture(scope="session")
def draw(camera):
    """Grey picture (360, 480) of a pattern (h, w), whose pixel [i, j] covers j to j + 1 and i to i + 1."""

    def render(pattern, pattern_px_per_m, origin_px, camera_T_target):
        n = SAMPLES_PER_SIDE
        u, v = np.meshgrid(*((np.arange(n * size) + 0.5) / n - 0.5 for size in (camera.width, camera.height)))
        homography = camera.K @ camera_T_target[:3, [0, 1, 3]]
        x, y, w = np.einsum("ij,jkl->ikl", np.linalg.inv(homography), np.stack([u, v, np.ones_like(u)]))
        column, row = (
            np.floor(value / w * pattern_px_per_m + offset).astype(int)
            for value, offset in zip((x, y), origin_px, strict=True)
        )
        inside = (column >= 0) & (row >= 0) & (column < pattern.shape[1]) & (row < pattern.shape[0])
        fine = np.full(u.shape, 110.0)
        fine[inside] = pattern[row[inside], column[inside]]
        grey = fine.reshape(camera.height, n, camera.width, n).mean((1, 3)) * 0.8 + 20
        noise = np.random.default_rng(0).normal(0, 1, grey.shape)
        return np.clip(np.rint(grey + noise), 0, 255).astype(np.uint8)

    return render


@pytest.fixture(scope="session")
def chessboard():
    """Pattern of a board with so many inner corners, 20 px a square; the first inner corner is at (40, 40)."""

    def make(columns, rows):
        squares = (np.indices((rows + 1, columns + 1)).sum(0) % 2 * 255).astype(np.uint8)
        return np.pad(np.kron(squares, np.ones((20, 20), np.uint8)), 20, constant_values=255)

    return make


@pytest.fixture(scope="session")
def circles():
    """Pattern of a grid of dots, 40 px apart, the first at (40, 40), larger when `marked`."""

    def make(columns, rows, marked=False):
        y, x = np.mgrid[: 40 * rows + 40, : 40 * columns + 40] + 0.5
        pattern = np.full(x.shape, 255, np.uint8)
        for row in range(rows):
            for column in range(columns):
                radius = 15 if marked and row == column == 0 else 10
                pattern[(x - 40 * (column + 1)) ** 2 + (y - 40 * (row + 1)) ** 2 < radius**2] = 0
        return pattern

    return make


@pytest.fixture(scope="session")
def bias(camera):
    """Mean offset (2,) and rms of found points against where a pose puts the target's points, px."""
    from hecbench_plugins.markers.target_poses import project

    def measure(found, camera_T_target, points_m):
        expected = np.array([project(camera, pose, points_m) for pose in camera_T_target])
        difference = (np.array(found) - expected).reshape(-1, 2)
        difference = difference[np.isfinite(difference[:, 0])]
        return difference.mean(0), float(np.sqrt((difference**2).sum(1).mean()))

    return measure


@pytest.fixture(scope="session")
def drawn():
    """Pictures of printed targets under a known pose."""
    return seen
