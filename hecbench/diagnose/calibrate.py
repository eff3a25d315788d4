"""A quick calibration for `check`: what the poses agree on, whatever some of them say.

Target poses are turned back into image points of a rectangle (or box) around the target, seen by an ideal
camera: in pixels a target pose weighs by what its image really tells, little about depth and tilt, and the two
poses of a planar target that look alike count as alike. The target's size is an unknown too.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.bundle.adjustment import DescentSettings, adjust
from hecbench.bundle.model import Noise, Problem, State, linearise
from hecbench.diagnose.fit import EXPLAINS, TYPICAL_NOISE, Fit, IdealCamera
from hecbench.errors import SolverFailure
from hecbench.recording import Mounting, hand_poses
from hecbench.se3 import Array

_ASSUMED_FOCAL_PX = 1000.0
_ASSUMED_HALF_WIDTH = 0.05
_PAIR_ANGLE_RAD = np.deg2rad(1.0)
_POSITIONS_FOR_LINEAR = 6
_ITERATIONS = 20
_MOST_COMPARED = 100


def spread(count: int) -> NDArray[np.int64]:
    """At most 100 indices, evenly spaced: comparing all pairs of thousands of samples gains nothing."""
    return np.unique(np.linspace(0, count - 1, min(count, _MOST_COMPARED)).astype(int))


def enclosing_points(points_m: Array) -> Array:
    """Corners (4, 3) m of the rectangle, or (8, 3) of the box, around target points."""
    low, high = points_m.min(0), points_m.max(0)
    ends = [sorted({float(a), float(b)}) for a, b in zip(low, high, strict=True)]
    return np.array(np.meshgrid(*ends)).reshape(3, -1).T


def assumed_points(camera_T_target: Array) -> Array:
    """Corners (4, 3) m of a square for an unknown target: a tenth of its distance wide."""
    half = _ASSUMED_HALF_WIDTH * float(np.median(np.linalg.norm(camera_T_target[:, :3, 3], axis=1)))
    return enclosing_points(np.array([[-half, -half, 0.0], [half, half, 0.0]]))


def calibrate(
    mounting: Mounting,
    base_T_flange: Array,
    camera_T_target: Array,
    points_m: Array,
    focal_px: float | None = None,
) -> Fit | None:
    """The calibration with the least robust pixel error, from up to two starts; None when there is none.

    Args:
        mounting: where the camera sits.
        base_T_flange: (N, 4, 4) m.
        camera_T_target: (N, 4, 4) m.
        points_m: (P, 3) of `enclosing_points`.
        focal_px: of the camera, None when unknown.
    """
    focal_px = focal_px or _ASSUMED_FOCAL_PX
    sensor = IdealCamera(focal_px)
    seen = se3.transform_points(camera_T_target, points_m)
    observed = sensor(seen.reshape(-1, 3), np.zeros(0))[0].reshape(*seen.shape[:2], 2)
    problem = Problem(mounting, base_T_flange, points_m, observed, sensor, free_scale=True)
    noise = Noise(TYPICAL_NOISE.observed)
    found: list[Fit] = []
    starts = list(_starts(problem, camera_T_target))
    for state in sorted(starts, key=lambda state: linearise(problem, state, noise).cost):
        with suppress(SolverFailure, np.linalg.LinAlgError):
            solution = adjust(problem, state, noise, DescentSettings(iterations=_ITERATIONS))
            found.append(Fit(problem, solution.state, focal_px))
            if found[-1].relative < EXPLAINS:
                break
    return min(found, key=lambda candidate: candidate.typical_px, default=None)


def _starts(problem: Problem, camera_T_target: Array) -> Iterator[State]:
    """From the rotations, and from the positions alone, which planar flips do not touch."""
    chosen = spread(len(camera_T_target))
    hand, camera_T_target = (
        hand_poses(problem.mounting, problem.base_T_flange)[chosen],
        camera_T_target[chosen],
    )
    for rotation in (_from_rotations(hand, camera_T_target), _from_positions(hand, camera_T_target)):
        if rotation is None:
            continue
        scale, translation, marker = _given_rotation(rotation, hand, camera_T_target)
        turned = np.swapaxes(hand[:, :3, :3], 1, 2) @ rotation @ camera_T_target[:, :3, :3]
        carrier_T_target = se3.make(_most_agreed(turned), marker)
        parent_T_camera = se3.make(rotation, translation)
        yield State(parent_T_camera, carrier_T_target, problem.base_T_flange, problem.parameters, scale)


def _from_rotations(hand: Array, camera_T_target: Array) -> Array | None:
    """R_X from the motions' rotation vectors (Park and Martin 1994); motions whose angles differ weigh little."""
    i, j = np.triu_indices(len(hand), 1)
    A = se3.so3_log(hand[j, :3, :3] @ np.swapaxes(hand[i, :3, :3], 1, 2))
    B = se3.so3_log(camera_T_target[j, :3, :3] @ np.swapaxes(camera_T_target[i, :3, :3], 1, 2))
    angle_gaps = np.linalg.norm(A, axis=1) - np.linalg.norm(B, axis=1)
    weights = 1 / (1 + (angle_gaps / _PAIR_ANGLE_RAD) ** 2)
    return se3.nearest_rotation((weights[:, None] * A).T @ B)


def _from_positions(hand: Array, camera_T_target: Array) -> Array | None:
    """R_X from ``G p_i + t - R_i m = t_i`` with a free 3x3 G (after Jin et al. 2024)."""
    count = len(hand)
    if count < _POSITIONS_FOR_LINEAR:
        return None
    rows = np.zeros((count, 3, 15))
    rows[:, :, :9] = np.einsum("ij,nk->nijk", np.eye(3), camera_T_target[:, :3, 3]).reshape(count, 3, 9)
    rows[:, :, 9:12], rows[:, :, 12:] = np.eye(3), -hand[:, :3, :3]
    solution = np.linalg.lstsq(rows.reshape(-1, 15), hand[:, :3, 3].ravel(), rcond=None)[0]
    return se3.nearest_rotation(solution[:9].reshape(3, 3))


def _given_rotation(rotation: Array, hand: Array, camera_T_target: Array) -> tuple[float, Array, Array]:
    """s, t_X and the target's origin m of ``s R_X p_i + t_X - R_i m = t_i``, by reweighted least squares."""
    rows = np.zeros((len(hand), 3, 7))
    rows[:, :, 0] = camera_T_target[:, :3, 3] @ rotation.T
    rows[:, :, 1:4], rows[:, :, 4:] = np.eye(3), -hand[:, :3, :3]
    weights = np.ones(len(hand))
    for _ in range(5):
        root = np.sqrt(weights)[:, None]
        weighted = (root[..., None] * rows).reshape(-1, 7), (root * hand[:, :3, 3]).ravel()
        solution = np.linalg.lstsq(*weighted, rcond=None)[0]
        left = np.linalg.norm(rows @ solution - hand[:, :3, 3], axis=1)
        weights = 1 / np.maximum(left, max(float(np.median(left)), 1e-9))
    return abs(float(solution[0])) or 1.0, np.asarray(solution[1:4]), np.asarray(solution[4:])


def _most_agreed(rotations: Array) -> Array:
    """The one of rotations (N, 3, 3) that most others share."""
    angles = se3.rotation_angle(np.swapaxes(rotations, 1, 2)[:, None] @ rotations)
    return np.asarray(rotations[np.minimum(angles, np.deg2rad(10.0)).sum(1).argmin()])
