"""A calibration of a recording's samples, and how well each of them agrees with it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.bundle.adjustment import Solution, adjust
from hecbench.bundle.model import Noise, Problem, State, predict
from hecbench.recording import Mounting, hand_poses
from hecbench.samples.agreement import share_left
from hecbench.se3 import Array

TYPICAL_NOISE = Noise(0.5, float(np.deg2rad(0.1)), 1e-3)
"""Of a corner of a good target and of a good arm: px, rad, m."""
LEAST_SAMPLES = 4
MUCH_BETTER = 0.35
"""Ratio of typical residuals below which another reading of the data is the right one."""
EXPLAINS = 0.15
"""Of the target's motion in the image; a wrong reading leaves about as much as it moves."""
_WIDE = np.repeat([np.deg2rad(10.0), 0.2], 3) ** -2.0
_POSE_FREEDOM = 6
_CHI2_MEDIAN = 5.35
"""Median of chi-square with 6 degrees of freedom."""
_ROBUST = 1.5
"""By how much the scatter may exceed what the median sample suggests."""
_LEAST_SCATTER = 0.02
"""Of the typical variances: exact data must not make rounding errors stand out."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A calibration of the N samples of a problem, with the target's size as a further unknown.

    Attributes:
        problem: the points of the rectangle or box, as the target poses would show them.
        state: the calibration; `scale` is the true size of the target over the declared one.
        focal_px: of the ideal camera.
    """

    problem: Problem
    state: State
    focal_px: float

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
        return share_left(self.residuals_px, np.linalg.norm(centres - np.median(centres, axis=0), axis=1))

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
        return np.asarray(se3.inverse(self.state.parent_T_camera) @ hand @ self.state.carrier_T_target)

    def in_mm(self, pixels: float) -> float:
        """What a distance in the image is at the target."""
        depth = float(np.median(self.camera_T_target[:, 2, 3]))
        return 1e3 * pixels * abs(depth) / self.focal_px

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

    def exceeded(self, agreeing: NDArray[np.bool_], chance: float) -> float:
        """The studentised distance that one of all samples exceeds with this chance although they are alike."""
        from scipy.special import fdtri

        unknowns = self.reduced[1].shape[1]
        freedom = max(_POSE_FREEDOM * int(agreeing.sum()) - unknowns, 1)
        return float(fdtri(_POSE_FREEDOM, freedom, 1 - chance / len(agreeing)))

    def subset(self, chosen: NDArray[np.integer] | NDArray[np.bool_]) -> Fit:
        """The same calibration of some of the samples."""
        problem = replace(
            self.problem,
            base_T_flange=self.problem.base_T_flange[chosen],
            observed=self.problem.observed[chosen],
        )
        state = replace(self.state, base_T_flange=self.state.base_T_flange[chosen])
        return Fit(problem, state, self.focal_px)

    def with_robot_poses(self, base_T_flange: Array) -> Fit:
        """The same calibration with other robot poses (N, 4, 4)."""
        problem = replace(self.problem, base_T_flange=base_T_flange)
        return Fit(problem, replace(self.state, base_T_flange=base_T_flange), self.focal_px)

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
        state = replace(solution.state, base_T_flange=self.problem.base_T_flange)
        return Fit(self.problem, state, self.focal_px)


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
