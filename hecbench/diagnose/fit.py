"""A quick calibration for `check`: what the poses agree on, whatever some of them say.

Target poses are turned back into image points of a rectangle (or box) around the target, seen by an ideal
camera: in pixels a target pose weighs by what its image really tells, little about depth and tilt, and the two
poses of a planar target that look alike count as alike. The target's size is an unknown too.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.bundle_adjustment import Solution, adjust
from hecbench.bundle_model import Noise, Problem, State, linearise, predict
from hecbench.errors import SolverFailure
from hecbench.recording import Mounting

Array = NDArray[np.float64]

TYPICAL_NOISE = Noise(0.5, float(np.deg2rad(0.1)), 1e-3)
"""Of a corner of a good target and of a good arm: px, rad, m."""
LEAST_SAMPLES = 4
MUCH_BETTER = 0.35
"""Ratio of typical residuals below which another reading of the data is the right one."""
EXPLAINS = 0.15
"""Of the target's motion in the image; a wrong reading leaves about as much as it moves."""
_ASSUMED_FOCAL_PX = 1000.0
_ASSUMED_HALF_WIDTH = 0.05
_WIDE = np.repeat([np.deg2rad(10.0), 0.2], 3) ** -2.0
_PAIR_ANGLE_RAD = np.deg2rad(1.0)
_POSITIONS_FOR_LINEAR = 6
_POSE_FREEDOM = 6
_CHI2_MEDIAN = 5.35
"""Median of chi-square with 6 degrees of freedom."""
_ROBUST = 1.5
"""By how much the scatter may exceed what the median sample suggests."""
_LEAST_SCATTER = 0.02
"""Of the typical variances: exact data must not make rounding errors stand out."""
_ITERATIONS = 20
_MOST_COMPARED = 100


@dataclass(frozen=True, eq=False)
class Fit:
    """A calibration of the N samples of a problem, with the target's size as a further unknown.

    Attributes:
        problem: the points of the rectangle or box, as the target poses would show them.
        state: the calibration; `scale` is the true size of the target over the declared one.
    """

    problem: Problem
    state: State

    @cached_property
    def residuals_px(self) -> Array:
        """Rms distance (N,) px between what the calibration predicts and what was seen."""
        values, _, _ = predict(self.problem, self.state)
        return np.asarray(np.sqrt(((values - self.problem.observed) ** 2).sum(-1).mean(1)))

    @cached_property
    def shifts_px(self) -> Array:
        """Where the centre of the target was seen against where it is predicted (N, 2)."""
        values, _, _ = predict(self.problem, self.state)
        return np.asarray((self.problem.observed - values).mean(1))

    @property
    def typical_px(self) -> float:
        """The median of the samples' residuals."""
        return float(np.median(self.residuals_px))

    @property
    def relative(self) -> float:
        """The typical residual over the target's own motion in the image."""
        centres = self.problem.observed.mean(1)
        moved = float(np.median(np.linalg.norm(centres - np.median(centres, axis=0), axis=1)))
        return self.typical_px / max(moved, 1e-9)

    def cures(self, given: Fit | None) -> bool:
        """Whether this reading of the data explains them, and the given one does much worse."""
        return self.relative < EXPLAINS and (
            given is None or self.typical_px < MUCH_BETTER * given.typical_px
        )

    @cached_property
    def camera_T_target(self) -> Array:
        """(N, 4, 4) m as predicted."""
        return self._predicted(self.problem.base_T_flange)

    def _predicted(self, base_T_flange: Array) -> Array:
        hand = hand_poses(self.problem.mounting, base_T_flange)
        return np.asarray(se3.inverse(self.state.parent_T_camera) @ hand @ self.state.other_T_target)

    def in_mm(self, pixels: float) -> float:
        """What a distance in the image is at the target."""
        depth = float(np.median(self.camera_T_target[:, 2, 3]))
        return 1e3 * pixels * abs(depth) / float(self.problem.sensor.focal_px)  # type: ignore[attr-defined]

    @cached_property
    def reduced(self) -> tuple[Array, Array, Array]:
        """What each sample says about the shared unknowns once its robot pose may move by the typical noise.

        Returns:
            Squared Mahalanobis distances (N,), gradients (N, G) and information (N, G, G).
        """
        r, J, J_robot = self._whitened
        inner = np.swapaxes(J_robot, 1, 2) @ J_robot + np.diag(TYPICAL_NOISE.robot_information)
        free_r = r - J_robot @ np.linalg.solve(inner, np.swapaxes(J_robot, 1, 2) @ r)
        free_J = J - J_robot @ np.linalg.solve(inner, np.swapaxes(J_robot, 1, 2) @ J)
        transposed = np.swapaxes(J, 1, 2)
        return (r * free_r).sum((1, 2)), (transposed @ free_r)[..., 0], transposed @ free_J

    @property
    def _whitened(self) -> tuple[Array, Array, Array]:
        """Residuals (N, R, 1), and derivatives by the shared unknowns (N, R, G) and by robot poses (N, R, 6)."""
        values, _, jacobian = predict(self.problem, self.state)
        columns = slice(6, 12) if self.problem.mounting is Mounting.EYE_TO_HAND else slice(0, 6)
        count = len(values)
        J = jacobian.reshape(count, -1, jacobian.shape[-1]) / TYPICAL_NOISE.observed
        r = (values - self.problem.observed).reshape(count, -1, 1) / TYPICAL_NOISE.observed
        return r, J, J[..., columns]

    def displacements(self) -> tuple[Array, Array]:
        """By how many mm (N,) and deg (N,) a change of the robot pose must displace the target to explain it."""
        r, _, J_robot = self._whitened
        transposed = np.swapaxes(J_robot, 1, 2)
        changes = -np.linalg.solve(transposed @ J_robot + np.diag(_WIDE), transposed @ r)[..., 0]
        explained = self._predicted(self.problem.base_T_flange @ se3.exp(changes))
        millimetres = 1e3 * se3.translation_error_m(self.camera_T_target, explained)
        return millimetres, np.rad2deg(np.linalg.norm(changes[:, :3], axis=1))

    def studentised(self, agreeing: NDArray[np.bool_]) -> Array:
        """How unlikely each sample is given the agreeing others: about 1 when it is like them (F distributed).

        The squared distance (6 degrees of freedom) of a sample from what the others predict, their calibration's
        own uncertainty included, over their scatter.
        """
        squares, gradients, information = self.reduced
        total, unknowns = information[agreeing].sum(0), gradients.shape[1]
        sign = np.where(agreeing, 1.0, -1.0)
        others = total - sign[:, None, None] * information
        steps = np.linalg.solve(others, gradients[..., None])[..., 0]
        distances = squares + sign * (gradients * steps).sum(1)
        freedom = _POSE_FREEDOM * (agreeing.sum() - agreeing) - unknowns
        scatter = (squares[agreeing].sum() - np.where(agreeing, distances, 0.0)) / np.maximum(freedom, 1)
        robust = _ROBUST * float(np.median(distances)) / _CHI2_MEDIAN
        return np.asarray(
            distances / _POSE_FREEDOM / np.clip(scatter, _LEAST_SCATTER, max(robust, _LEAST_SCATTER))
        )

    def subset(self, chosen: NDArray[np.integer] | NDArray[np.bool_]) -> Fit:
        """The same calibration of some of the samples."""
        problem = replace(
            self.problem,
            base_T_flange=self.problem.base_T_flange[chosen],
            observed=self.problem.observed[chosen],
        )
        return Fit(problem, replace(self.state, base_T_flange=self.state.base_T_flange[chosen]))

    def with_robot_poses(self, base_T_flange: Array) -> Fit:
        """The same calibration with other robot poses (N, 4, 4)."""
        problem = replace(self.problem, base_T_flange=base_T_flange)
        return Fit(problem, replace(self.state, base_T_flange=base_T_flange))

    def refined(self) -> Solution:
        """The calibration with robot corrections under the typical noise, and its covariance.

        Raises:
            SolverFailure: the data do not determine it.
        """
        return adjust(self.problem, self.state, TYPICAL_NOISE)

    def refitted_to(self, chosen: NDArray[np.bool_]) -> Fit:
        """The calibration of some samples, applied to all of them.

        Raises:
            SolverFailure: the data do not determine it.
        """
        solution = self.subset(chosen).refined()
        return Fit(self.problem, replace(solution.state, base_T_flange=self.problem.base_T_flange))


class IdealCamera:
    """A pinhole without distortion as a sensor of `bundle_model`."""

    def __init__(self, focal_px: float) -> None:
        self.focal_px = focal_px

    def __call__(self, points_c: Array, parameters: Array) -> tuple[Array, Array, Array]:
        """Pixels (M, 2) about the principal point, and derivatives."""
        depth = points_c[:, 2:]
        pixels = self.focal_px * points_c[:, :2] / depth
        by_point = np.zeros((len(points_c), 2, 3))
        by_point[:, 0, 0] = by_point[:, 1, 1] = self.focal_px / depth[:, 0]
        by_point[:, :, 2] = -pixels / depth
        return pixels, by_point, np.zeros((len(points_c), 2, 0))


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


def hand_poses(mounting: Mounting, base_T_flange: Array) -> Array:
    """H (N, 4, 4) m of `Recording.hand_poses`."""
    return base_T_flange if mounting is Mounting.EYE_TO_HAND else se3.inverse(base_T_flange)


def fit(
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
    sensor = IdealCamera(focal_px or _ASSUMED_FOCAL_PX)
    seen = se3.transform_points(camera_T_target, points_m)
    observed = sensor(seen.reshape(-1, 3), np.zeros(0))[0].reshape(*seen.shape[:2], 2)
    problem = Problem(mounting, base_T_flange, points_m, observed, sensor, free_scale=True)
    noise = Noise(TYPICAL_NOISE.observed)
    found: list[Fit] = []
    starts = list(_starts(problem, camera_T_target))
    for state in sorted(starts, key=lambda state: linearise(problem, state, noise).cost):
        with suppress(SolverFailure, np.linalg.LinAlgError):
            found.append(Fit(problem, adjust(problem, state, noise, max_iterations=_ITERATIONS).state))
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
        other_T_target = se3.make(_most_agreed(turned), marker)
        parent_T_camera = se3.make(rotation, translation)
        yield State(parent_T_camera, other_T_target, problem.base_T_flange, problem.parameters, scale)


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
