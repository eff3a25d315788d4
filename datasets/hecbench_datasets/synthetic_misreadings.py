"""Good generated board recordings, near the camera, misread as real ones are: lens, matrix, board, order, rotations.

Like `synthetic_faults`, to see whether `check` names the cause; the board is large enough in the picture that its
corners alone say something about lens and board.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hecbench import preparation, se3
from hecbench.diagnose.clock_lag import interpolated
from hecbench.lens import EQUIDISTANT, OPENCV, CameraModel, distort, project
from hecbench.recording import Mounting, Recording
from hecbench.se3 import Array
from hecbench.targets import ChessboardTarget
from hecbench_datasets.suites.synthetic_markers import MarkerSetting, generate
from hecbench_datasets.synthetic_faults import Fault

_FILM_STEP_S, _FILM_GAP_S = 1.5, 0.1
"""From pose to pose, and from frame to frame, where a recording's poses become a film."""

NEAR_BOARD = MarkerSetting(
    ChessboardTarget(9, 6, 0.025),
    samples=17,
    mounting=Mounting.EYE_IN_HAND,
    distance_m=0.5,
    box_m=0.2,
    pixel_noise_px=0.1,
    width=1280,
    height=720,
    focal_px=900.0,
)


def near_board(rng: np.random.Generator, samples: int = 17, eye_to_hand: bool = False) -> Recording:
    """A recording without fault; more of the board's corners lie in the picture than beside it."""
    mounting = Mounting.EYE_TO_HAND if eye_to_hand else Mounting.EYE_IN_HAND
    return generate(replace(NEAR_BOARD, samples=samples, mounting=mounting), rng)


def _webcam(rng: np.random.Generator) -> Array:
    return np.array([rng.uniform(-0.4, -0.2), rng.uniform(0.05, 0.15), *rng.uniform(-2e-3, 2e-3, 2), 0.0])


def _bent(recording: Recording, distortion: Array, model: str = OPENCV) -> Recording:
    """The recording as a lens of these coefficients shows it, with the lens declared."""
    camera, corners = recording.present.camera, recording.present.corners_px
    lens = replace(camera, distortion=distortion, distortion_model=model)
    focal, centre = np.diag(camera.intrinsics)[:2], camera.intrinsics[:2, 2]
    return replace(
        recording, camera=lens, corners_px=distort((corners - centre) / focal, lens) * focal + centre
    )


def _with_camera(recording: Recording, **changes: object) -> Recording:
    camera = recording.camera
    assert isinstance(camera, CameraModel)
    return replace(recording, camera=replace(camera, **changes))  # type: ignore[arg-type]


def lens_left_out(recording: Recording, rng: np.random.Generator) -> Recording:
    """A webcam's corners without its distortion."""
    return _with_camera(_bent(recording, _webcam(rng)), distortion=np.zeros(0))


def lens_twice(recording: Recording, rng: np.random.Generator) -> Recording:
    """Corners of rectified pictures with the distortion of the raw ones."""
    return _with_camera(recording, distortion=_webcam(rng))


def fisheye_as_opencv(recording: Recording, rng: np.random.Generator) -> Recording:
    """An equidistant lens whose coefficients are declared as OpenCV's."""
    bent = _bent(recording, rng.uniform(-0.05, 0.05, 4), EQUIDISTANT)
    return _with_camera(bent, distortion_model=OPENCV)


def coefficients_reordered(recording: Recording, rng: np.random.Generator) -> Recording:
    """k1 k2 k3 p1 p2 where k1 k2 p1 p2 k3 belong."""
    true = np.array([rng.uniform(-0.4, -0.2), rng.uniform(0.1, 0.2), 4e-3, -3e-3, rng.uniform(-0.1, -0.05)])
    return _with_camera(_bent(recording, true), distortion=true[[0, 1, 4, 2, 3]])


def squares_not_square(recording: Recording, rng: np.random.Generator) -> Recording:
    """A board whose printer scaled one direction: the corners are those of the true one, seen with its own pitch."""
    corners, target, camera = recording.present.corners_px, recording.target, recording.present.camera
    assert isinstance(target, ChessboardTarget)
    pitch = rng.choice([0.97, 0.98, 1.02, 1.03])
    grid = corners.reshape(len(corners), target.rows, target.columns, 2)
    stretched = _stretched(grid, float(pitch)).reshape(corners.shape)
    return replace(recording, corners_px=_inside(stretched, camera))


def _stretched(grid: Array, pitch: float) -> Array:
    """Corners (N, rows, columns, 2) px of a board whose rows are `pitch` times as far apart, by homographies."""
    rows, columns = grid.shape[1:3]
    v, u = (axis.ravel().astype(float) for axis in np.mgrid[:rows, :columns])
    plain, wide = np.stack([u, v, np.ones_like(u)], 1), np.stack([u, pitch * v, np.ones_like(u)], 1)
    stretched = []
    for picture in grid.reshape(len(grid), -1, 2):
        seen = np.isfinite(picture).all(1)
        x, y = picture[seen].T
        zero = np.zeros((seen.sum(), 3))
        first = np.concatenate([plain[seen], zero, -x[:, None] * plain[seen]], 1)
        second = np.concatenate([zero, plain[seen], -y[:, None] * plain[seen]], 1)
        H = np.linalg.svd(np.concatenate([first, second]))[2][-1].reshape(3, 3)
        there, here = wide @ H.T, plain @ H.T
        stretched.append(picture + there[:, :2] / there[:, 2:] - here[:, :2] / here[:, 2:])
    return np.array(stretched)


def transposed(recording: Recording, rng: np.random.Generator) -> Recording:
    """Corners listed column by column."""
    assert isinstance(recording.target, ChessboardTarget)
    columns, rows = recording.target.columns, recording.target.rows
    order = np.arange(columns * rows).reshape(rows, columns).T.ravel()
    return replace(recording, corners_px=recording.present.corners_px[:, order])


def other_focal_length(recording: Recording, rng: np.random.Generator) -> Recording:
    """The matrix of the raw pictures for rectified ones: 5 to 10 % longer, and some pixels off."""
    K = recording.present.camera.intrinsics.copy()
    K[[0, 1], [0, 1]] *= rng.uniform(1.05, 1.1) * np.array([1.0, rng.uniform(0.995, 1.005)])
    K[:2, 2] += rng.uniform(-10, 10, 2)
    return _with_camera(recording, K=K)


def cropped(recording: Recording, rng: np.random.Generator) -> Recording:
    """The principal point of the whole picture for a cropped one: off by 100 px or more."""
    K = recording.present.camera.intrinsics.copy()
    K[:2, 2] += rng.choice([-1.0, 1.0], 2) * rng.uniform([100.0, 50.0], [150.0, 90.0])
    return _with_camera(recording, K=K)


def frozen_target(recording: Recording, rng: np.random.Generator) -> Recording:
    """The target's corners stay what they were from the middle on."""
    corners = recording.present.corners_px.copy()
    corners[len(corners) // 2 :] = corners[len(corners) // 2]
    return replace(recording, corners_px=corners)


def frozen_robot(recording: Recording, rng: np.random.Generator) -> Recording:
    """The robot's pose stays what it was for the last third."""
    poses = recording.present.base_T_flange.copy()
    poses[-len(poses) // 3 :] = poses[-len(poses) // 3]
    return replace(recording, base_T_flange=poses)


def rows_missed(recording: Recording, rng: np.random.Generator) -> Recording:
    """Two robot poses in the middle were not written: from there on each belongs to the image two rows later.

    Two images or more still have their pose among the rows; where none has, nothing shows a shift.
    """
    first = len(recording) // 2 - int(rng.integers(0, 3))
    poses = recording.present.base_T_flange
    kept = recording.subset(range(len(recording) - 2))
    return replace(kept, base_T_flange=np.concatenate([poses[:first], poses[first + 2 :]]))


def text_order(recording: Recording, rng: np.random.Generator) -> Recording:
    """Robot poses sorted by name as text, images by number."""
    order = sorted(range(len(recording)), key=str)
    return replace(recording, base_T_flange=recording.present.base_T_flange[order])


def images_late(recording: Recording, rng: np.random.Generator) -> Recording:
    """A film along the recording's poses, its images 0.1 to 0.3 s older than the robot poses of their stamps."""
    truth, hand = recording.present.truth_parent_T_camera, recording.hand_poses()
    camera_T_target = preparation.prepare(recording).present.camera_T_target
    carrier_T_target = se3.mean(se3.inverse(hand) @ truth @ camera_T_target)
    seconds = np.arange(len(hand), dtype=float) * _FILM_STEP_S
    times = np.arange(seconds[0] + 0.5, seconds[-1], _FILM_GAP_S)
    poses = interpolated(seconds, recording.present.base_T_flange, times)
    before = interpolated(seconds, recording.present.base_T_flange, times - rng.uniform(0.1, 0.3))
    film = Recording(
        name=recording.name,
        mounting=recording.mounting,
        sample_ids=tuple(f"{i:06d}" for i in range(len(times))),
        camera=recording.camera,
        target=recording.target,
        base_T_flange=poses,
        robot_stamp_s=times,
        camera_stamp_s=times,
    )
    seen = se3.inverse(truth) @ replace(film, base_T_flange=before).hand_poses() @ carrier_T_target
    points = se3.transform_points(seen, film.present.target.points_m)
    corners = project(film.present.camera, points) + rng.normal(
        0.0, NEAR_BOARD.pixel_noise_px, (*points.shape[:2], 2)
    )
    return replace(film, corners_px=_inside(corners, film.present.camera))


def _inside(corners: Array, camera: CameraModel) -> Array:
    """Corners (N, P, 2) px, NaN where they lie outside the picture."""
    outside = ((corners < -0.5) | (corners > [camera.width - 0.5, camera.height - 0.5])).any(-1)
    return np.where(np.expand_dims(outside, -1), np.nan, corners)


def _rotations_replaced(recording: Recording, rotations: Array) -> Recording:
    poses = recording.present.base_T_flange.copy()
    poses[:, :3, :3] = rotations
    return replace(recording, base_T_flange=poses)


def vectors_as_angles(recording: Recording, rng: np.random.Generator) -> Recording:
    """Rotation vectors taken for roll pitch yaw."""
    from scipy.spatial.transform import Rotation

    vectors = se3.so3_log(recording.present.base_T_flange[:, :3, :3])
    return _rotations_replaced(recording, Rotation.from_euler("xyz", vectors).as_matrix())


def quaternions_shifted(recording: Recording, rng: np.random.Generator) -> Recording:
    """w x y z taken for x y z w."""
    from scipy.spatial.transform import Rotation

    quaternions = Rotation.from_matrix(recording.present.base_T_flange[:, :3, :3]).as_quat()
    return _rotations_replaced(recording, Rotation.from_quat(quaternions[:, [3, 0, 1, 2]]).as_matrix())


def mirrored(recording: Recording, rng: np.random.Generator) -> Recording:
    """Pictures flipped left to right."""
    flipped = recording.present.corners_px * [-1.0, 1.0] + [recording.present.camera.width - 1.0, 0.0]
    return replace(recording, corners_px=flipped)


MISREADINGS: Mapping[str, Fault] = {
    "lens left out": Fault(lens_left_out, "lens_model"),
    "lens applied twice": Fault(lens_twice, "lens_model"),
    "fisheye read as OpenCV's": Fault(fisheye_as_opencv, "lens_model"),
    "coefficients in another order": Fault(coefficients_reordered, "lens_model"),
    "squares not square": Fault(squares_not_square, "target_shape"),
    "corners transposed": Fault(transposed, "corner_order"),
    "K of raw for rectified pictures": Fault(other_focal_length, "intrinsics"),
    "K of whole for cropped pictures": Fault(cropped, "intrinsics"),
    "target frozen": Fault(frozen_target, "repeated_samples"),
    "robot frozen": Fault(frozen_robot, "repeated_samples"),
    "rows missed": Fault(rows_missed, "pairing"),
    "sorted as text": Fault(text_order, "pairing"),
    "rotation vectors as angles": Fault(vectors_as_angles, "rotation_convention"),
    "quaternions shifted": Fault(quaternions_shifted, "rotation_convention"),
    "images late, stamps equal": Fault(images_late, "clock_lag"),
    "pictures mirrored": Fault(mirrored, "mirrored_images"),
}
"""What is done to `near_board`, and the finding that must name it."""
