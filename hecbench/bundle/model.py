"""The model of reprojection bundle adjustment of X = parent_T_camera and Y = carrier_T_target.

Ulrich and Hillemann 2024, "Uncertainty-aware hand-eye calibration", T-RO: besides X and Y every measured
robot pose is an unknown that observes itself, and the noise of each group of observations is estimated with
them. With the hand poses H of `Recording.hand_poses`, minimises

    sum rho(|u_ik - camera(inverse(X) H_i Y P_k)|^2 / s_px^2)
        + sum rho(|e_rot|^2 / s_rot^2 + |e_tr|^2 / s_tr^2)

with ``e_rot = log(R_measured^T R)``, ``e_tr = R_measured^T (t - t_measured)`` of base_T_flange, for both
mountings, and Huber's rho. Increments of X and Y act from the left in the parent frame, rotation first, so
that the covariance is the project's; those of robot poses act in the flange frame. Every residual touches X,
Y and one robot pose: the robot poses are eliminated by the Schur complement.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.recording import Mounting
from hecbench.se3 import Array

Sensor = Callable[[Array, Array], tuple[Array, Array, Array]]
"""From points (M, 3) m in the camera frame and its parameters (K,): what is observed of them (M, D), and the
derivatives by the points (M, D, 3) and by the parameters (M, D, K).
"""

HUBER_POINT_SIGMAS = 3.0
HUBER_ROBOT_SIGMAS = 4.5
"""Whitened norms, of a point (2 degrees of freedom) and of a robot pose (6), that Gaussian noise exceeds once
in a hundred and once in five hundred times.
"""


@dataclass(frozen=True, eq=False)
class Problem:
    """What was measured.

    Attributes:
        mounting: where the camera sits.
        base_T_flange: (N, 4, 4) m as measured.
        points_m: target points (P, 3).
        observed: (N, P, D), NaN where a point was not seen.
        sensor: the camera.
        parameters: of the sensor (K,), a prior mean.
        parameter_sigmas: (K,) of that prior; K = 0 keeps the sensor as it is.
        free_scale: whether the target's size is an unknown too.
    """

    mounting: Mounting
    base_T_flange: Array
    points_m: Array
    observed: Array
    sensor: Sensor
    parameters: Array = field(default_factory=lambda: np.zeros(0))
    parameter_sigmas: Array = field(default_factory=lambda: np.zeros(0))
    free_scale: bool = False

    @property
    def seen(self) -> NDArray[np.bool_]:
        """(N, P) points that were observed."""
        return np.asarray(np.isfinite(self.observed).all(-1))


@dataclass(frozen=True)
class Noise:
    """Standard deviations: of an observed coordinate, and of a robot pose per axis.

    `robot_is_exact` keeps the measured robot poses and ignores the other two.
    """

    observed: float
    rotation_rad: float = 0.0
    translation_m: float = 0.0

    @property
    def robot_is_exact(self) -> bool:
        """Whether robot poses are kept as measured."""
        return self.rotation_rad == 0.0 and self.translation_m == 0.0

    @property
    def robot_information(self) -> Array:
        """(6,) inverse variances, rotation first."""
        return np.repeat([self.rotation_rad**-2.0, self.translation_m**-2.0], 3)


@dataclass(frozen=True, eq=False)
class State:
    """The unknowns; `base_T_flange` are the corrected robot poses."""

    parent_T_camera: Array
    carrier_T_target: Array
    base_T_flange: Array
    parameters: Array
    scale: float = 1.0

    def moved(self, shared: Array, robot: Array) -> State:
        """After increments of the shared unknowns [X, Y, scale?, parameters] and of robot poses (N, 6)."""
        rest = shared[12:]
        scale = self.scale
        if len(rest) > len(self.parameters):
            scale, rest = scale * float(np.exp(rest[0])), rest[1:]
        return State(
            se3.exp(shared[:6]) @ self.parent_T_camera,
            se3.exp(shared[6:12]) @ self.carrier_T_target,
            self.base_T_flange @ se3.exp(robot) if robot.any() else self.base_T_flange,
            self.parameters + rest,
            scale,
        )


def start(problem: Problem, parent_T_camera: Array, carrier_T_target: Array) -> State:
    """The state before any correction."""
    return State(parent_T_camera, carrier_T_target, problem.base_T_flange, problem.parameters)


@dataclass(frozen=True, eq=False)
class Linearisation:
    """Residuals at a state and the normal equations, whitened and with Huber's weights.

    Attributes:
        residuals: predicted minus observed (N, P, D), 0 where not seen.
        corrections: [e_rot, e_tr] of the robot poses (N, 6).
        cost: twice the negative log-likelihood, robust.
        information: of each sample's observations about the shared unknowns (N, G, G).
        gradients: of each sample's observations (N, G).
        robot_columns: which of the shared unknowns move a sample's points as its robot pose does.
        shared: information of the shared unknowns (G, G), with the prior of the sensor's parameters.
        gradient_shared: (G,).
        robot: information of each robot pose (N, 6, 6), with its own observation.
        gradient_robot: (N, 6).
        own_information: what robot poses know of themselves, rotation and translation apart (2, N, 6, 6).
        squares: weighted whitened squares of the groups: observed, rotation, translation.
    """

    residuals: Array
    corrections: Array
    cost: float
    information: Array
    gradients: Array
    robot_columns: slice
    shared: Array
    gradient_shared: Array
    robot: Array
    gradient_robot: Array
    own_information: Array
    squares: Array

    @property
    def mixed(self) -> Array:
        """Information between the shared unknowns and each robot pose (N, G, 6)."""
        return self.information[:, :, self.robot_columns]


def predict(problem: Problem, state: State) -> tuple[Array, Array, Array]:
    """Observations (N, P, D) at a state, points in the camera frame (N, P, 3), derivatives (N, P, D, G)."""
    hand = (
        state.base_T_flange if problem.mounting is Mounting.EYE_TO_HAND else se3.inverse(state.base_T_flange)
    )
    parent_R_camera = state.parent_T_camera[:3, :3]
    y = se3.transform_points(state.carrier_T_target, state.scale * problem.points_m)
    q = se3.transform_points(hand, y)
    points = (q - state.parent_T_camera[:3, 3]) @ parent_R_camera
    values, by_point, by_parameter = problem.sensor(points.reshape(-1, 3), state.parameters)
    shape = (*points.shape[:2], values.shape[-1])
    by_parent = by_point.reshape(*shape, 3) @ parent_R_camera.T
    by_other = by_parent @ hand[:, None, :3, :3]
    columns = [np.cross(by_parent, q[:, :, None]), -by_parent, np.cross(y[:, None], by_other), by_other]
    if problem.free_scale:
        columns.append((by_other * (y - state.carrier_T_target[:3, 3])[:, None]).sum(-1, keepdims=True))
    if len(problem.parameters):
        columns.append(by_parameter.reshape(*shape, -1))
    return values.reshape(shape), points, np.concatenate(columns, -1)


def linearise(problem: Problem, state: State, noise: Noise) -> Linearisation:
    """Residuals and normal equations at a state; infinite cost when a seen point is behind the camera."""
    values, points, jacobian = predict(problem, state)
    seen = problem.seen
    residuals = np.where(seen[..., None], values - problem.observed, 0.0)
    norms = np.linalg.norm(residuals, axis=-1) / noise.observed
    weights = seen * _huber_weights(norms, HUBER_POINT_SIGMAS)
    cost = _huber_cost(norms, HUBER_POINT_SIGMAS)
    squares = np.array([(weights * norms**2).sum(), 0.0, 0.0])

    count, size = len(residuals), jacobian.shape[-1]
    root = np.sqrt(weights)[..., None] / noise.observed
    rows = (root[..., None] * jacobian).reshape(count, -1, size)
    whitened = (root * residuals).reshape(count, -1)
    information = np.swapaxes(rows, 1, 2) @ rows
    gradients = (np.swapaxes(rows, 1, 2) @ whitened[..., None])[..., 0]

    shared, gradient_shared = information.sum(0), gradients.sum(0)
    if known := len(problem.parameters):
        prior = (state.parameters - problem.parameters) / problem.parameter_sigmas
        shared[-known:, -known:] += np.diag(problem.parameter_sigmas**-2.0)
        gradient_shared[-known:] += prior / problem.parameter_sigmas
        cost += float(prior @ prior)

    columns = slice(6, 12) if problem.mounting is Mounting.EYE_TO_HAND else slice(0, 6)
    robot, gradient_robot = information[:, columns, columns], gradients[:, columns]
    corrections, own = np.zeros((count, 6)), np.zeros((2, count, 6, 6))
    if not noise.robot_is_exact:
        corrections = robot_corrections(problem.base_T_flange, state.base_T_flange)
        sizes = corrections**2 * noise.robot_information
        robot_norms = np.sqrt(sizes.sum(1))
        robot_weights = _huber_weights(robot_norms, HUBER_ROBOT_SIGMAS)
        by_increment = _correction_derivatives(corrections)
        weighted = np.swapaxes(by_increment, 1, 2) * noise.robot_information * robot_weights[:, None, None]
        own[0] = weighted[..., :3] @ by_increment[:, :3]
        own[1] = weighted[..., 3:] @ by_increment[:, 3:]
        robot = robot + own.sum(0)
        gradient_robot = gradient_robot + (weighted @ corrections[..., None])[..., 0]
        cost += _huber_cost(robot_norms, HUBER_ROBOT_SIGMAS)
        squares[1:] = (robot_weights[:, None] * sizes).sum(0).reshape(2, 3).sum(1)
    if (points[seen][:, 2] <= 0).any():
        cost = np.inf
    return Linearisation(
        residuals,
        corrections,
        cost,
        information,
        gradients,
        columns,
        shared,
        gradient_shared,
        robot,
        gradient_robot,
        own,
        squares,
    )


def robot_corrections(measured: Array, corrected: Array) -> Array:
    """[e_rot rad, e_tr m] (N, 6) of base_T_flange, in the measured flange frame."""
    change = se3.inverse(measured) @ corrected
    return np.concatenate([se3.so3_log(change[:, :3, :3]), change[:, :3, 3]], 1)


def _correction_derivatives(corrections: Array) -> Array:
    """Derivatives (N, 6, 6) of [e_rot, e_tr] by increments of the corrected pose in its own frame."""
    derivatives = np.zeros((len(corrections), 6, 6))
    derivatives[:, :3, :3] = np.linalg.inv(se3.left_jacobian(-corrections[:, :3]))
    derivatives[:, 3:, 3:] = se3.so3_exp(corrections[:, :3])
    return derivatives


def _huber_weights(norms: Array, limit: float) -> Array:
    return np.minimum(1.0, limit / np.maximum(norms, limit))


def _huber_cost(norms: Array, limit: float) -> float:
    return float(np.where(norms <= limit, norms**2, 2 * limit * norms - limit**2).sum())
