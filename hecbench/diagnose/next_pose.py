"""Which further pose of the target would help most: the one with the smallest expected error afterwards."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.bundle.model import predict
from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity
from hecbench.diagnose.precision import Precision, information_of, precision
from hecbench.recording import CameraModel, hand_poses
from hecbench.se3 import Array
from hecbench.system.wording import significant

ID = "next_pose"
_TILT_DEG = 35.0
_STEP = 2.0
"""Of the rms extent of the positions so far, along each axis of the camera."""
_FACING = 0.3


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """Tries tilts and shifts of the typical target pose that stay in view, and names the most useful."""
    found = precision(case)
    if found is None or case.agreed is None:
        return None, case
    seen = case.agreed[0].camera_T_target[case.agreed[1]]
    centre, extent = seen[:, :3, 3].mean(0), seen[:, :3, 3].std(0)
    options = list(product(product((-1, 0, 1), repeat=3), product((-1, 0, 1), repeat=3)))
    options = [(turn, move) for turn, move in options if np.abs(turn).sum() <= 1 and np.abs(move).sum() <= 1]
    upright = _typical_rotation(seen[:, :3, :3])
    poses = np.array(
        [
            se3.make(
                se3.so3_exp(np.deg2rad(_TILT_DEG) * np.array(turn)) @ upright, centre + _STEP * extent * move
            )
            for turn, move in options
        ]
    )
    visible = np.flatnonzero(_visible(poses, seen, case.points_m, case.recording.camera))
    if not len(visible):
        return None, case
    now = found.expected_mm()
    after = [found.expected_mm(extra) for extra in _information(found, poses[visible])]
    best = int(np.argmin(after))
    turn, move = options[visible[best]]
    summary = (
        f"most useful next: the target {_turned(turn)}, {_moved(move, _STEP * extent)}: the expected error in the "
        f"workspace falls from {significant(now)} to {significant(after[best])} mm"
    )
    return Finding(ID, Severity.INFO, summary, value=after[best], limit=now), case


def _typical_rotation(rotations: Array) -> Array:
    return se3.nearest_rotation(rotations.mean(0))


def _information(found: Precision, camera_T_target: Array) -> Array:
    """About [X, Y] (M, 12, 12) that samples with these target poses would add."""
    X, Y = found.state.parent_T_camera, found.state.carrier_T_target
    hand = X @ camera_T_target @ se3.inverse(Y)
    poses = hand_poses(found.problem.mounting, hand)
    problem = replace(
        found.problem, base_T_flange=poses, observed=np.zeros((len(poses), *found.problem.observed.shape[1:]))
    )
    state = replace(found.state, base_T_flange=poses, scale=1.0)
    expected, _, _ = predict(problem, state)
    return information_of(replace(problem, observed=expected), state)[0]


def _visible(poses: Array, seen: Array, points_m: Array, camera: CameraModel | None) -> NDArray[np.bool_]:
    """Whether all points are in front of the camera and in the image, and the target shows the same face."""
    points = se3.transform_points(poses, points_m)
    visible = (points[..., 2] > 0).all(1)
    sight = poses[:, :3, 3] / np.linalg.norm(poses[:, :3, 3], axis=1)[:, None]
    face = np.sign(np.median((seen[:, :3, 2] * seen[:, :3, 3]).sum(1)))
    visible &= face * (poses[:, :3, 2] * sight).sum(1) > _FACING
    if camera is not None and camera.K is not None:
        pixels = points @ camera.K.T
        pixels = pixels[..., :2] / pixels[..., 2:]
        visible &= ((pixels > 0) & (pixels < [camera.width - 1, camera.height - 1])).all((1, 2))
    return np.asarray(visible)


def _turned(turn: tuple[int, ...]) -> str:
    if not any(turn):
        return "as it usually faces"
    axis = int(np.flatnonzero(turn)[0])
    return f"turned by {turn[axis] * _TILT_DEG:+.0f} deg about the camera's {'xyz'[axis]} axis"


def _moved(move: tuple[int, ...], steps_m: Array) -> str:
    if not any(move):
        return "at the middle of the positions so far"
    axis = int(np.flatnonzero(move)[0])
    return f"{1e3 * steps_m[axis]:.0f} mm {_DIRECTIONS[axis, move[axis]]} their middle"


_DIRECTIONS = {
    (0, -1): "left of",
    (0, 1): "right of",
    (1, -1): "above",
    (1, 1): "below",
    (2, -1): "nearer than",
    (2, 1): "beyond",
}
