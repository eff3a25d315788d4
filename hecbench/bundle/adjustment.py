"""Minimises the model of `bundle.model` and estimates the noise of its groups of observations.

Levenberg-Marquardt with the robot poses eliminated by the Schur complement; variance components after
Foerstner 1979 as in Ulrich and Hillemann 2024, "Uncertainty-aware hand-eye calibration", T-RO, section V.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hecbench.bundle.model import Linearisation, Noise, Problem, State, linearise
from hecbench.errors import SolverFailure
from hecbench.estimate import Termination
from hecbench.se3 import Array


@dataclass(frozen=True)
class DescentSettings:
    """When Levenberg-Marquardt ends.

    Attributes:
        iterations: at most.
        least_fall: of the cost, relative: near the rounding of double precision.
        least_step: of every increment, rad and m.
        first_damping, least_damping, largest_damping: times the diagonal; beyond the largest the descent has stalled.
    """

    iterations: int = 50
    least_fall: float = 1e-12
    least_step: float = 1e-11
    first_damping: float = 1e-4
    least_damping: float = 1e-12
    largest_damping: float = 1e12


@dataclass(frozen=True)
class NoiseSettings:
    """How the noise of a group of observations is estimated from its residuals.

    Attributes:
        rounds: of adjustment and estimation, at most.
        least_redundancy: observations minus unknowns below which the given noise is kept: it is not determined.
        largest_change: factor by which a noise may change in one round.
        settled: relative change below which the rounds end.
        correlated: ratio of variances that independent noise exceeds in one of hundreds of recordings of ten samples
            (simulated).
        floor_px, floor_rad, floor_m: exact data must not make the weights infinite; far below any device's noise.
    """

    rounds: int = 5
    least_redundancy: float = 10.0
    largest_change: float = 4.0
    settled: float = 0.02
    correlated: float = 2.5
    floor_px: float = 0.02
    floor_rad: float = float(np.deg2rad(0.002))
    floor_m: float = 2e-5


DESCENT, NOISE_ESTIMATION = DescentSettings(), NoiseSettings()


@dataclass(frozen=True, eq=False)
class Solution:
    """A minimum.

    Attributes:
        covariance: of the shared unknowns [X, Y, scale?, parameters] (G, G).
        robot_covariances: of the increments of the robot poses (N, 6, 6).
        redundancy: (3,) of observed, rotation, translation: observations minus what unknowns absorb.
    """

    state: State
    noise: Noise
    at: Linearisation
    covariance: Array
    robot_covariances: Array
    redundancy: Array
    termination: Termination
    iterations: int


def adjust(problem: Problem, state: State, noise: Noise, settings: DescentSettings = DESCENT) -> Solution:
    """Levenberg-Marquardt from a state.

    Raises:
        SolverFailure: the start sees a point behind the camera, or the data do not determine the unknowns.
    """
    at = linearise(problem, state, noise)
    if not np.isfinite(at.cost):
        raise SolverFailure("the start puts target points behind the camera: is the mounting right?")
    damping, termination, iterations = settings.first_damping, Termination.MAX_ITERATIONS, 0
    while iterations < settings.iterations and termination is Termination.MAX_ITERATIONS:
        iterations += 1
        shared, robot = _step(at, noise, damping)
        with np.errstate(all="ignore"):  # a step that is far too large has no finite cost, and is taken back
            candidate = state.moved(shared, robot)
            there = linearise(problem, candidate, noise)
        if there.cost <= at.cost:
            small = at.cost - there.cost <= settings.least_fall * at.cost or (
                max(np.abs(shared).max(), np.abs(robot).max()) < settings.least_step
            )
            state, at, damping = candidate, there, max(damping / 10, settings.least_damping)
            if small:
                termination = Termination.CONVERGED
        else:
            damping *= 10
            if damping > settings.largest_damping:
                termination = Termination.STALLED
            elif np.abs(shared).max() < settings.least_step:
                termination = Termination.CONVERGED
    covariance, robot_covariances = _covariances(at, noise)
    redundancy = _redundancy(problem, at, noise, covariance, robot_covariances)
    return Solution(state, noise, at, covariance, robot_covariances, redundancy, termination, iterations)


def _step(at: Linearisation, noise: Noise, damping: float) -> tuple[Array, Array]:
    """Damped Gauss-Newton increments of the shared unknowns (G,) and of the robot poses (N, 6)."""
    shared = _damped(at.shared, damping)
    if noise.robot_is_exact:
        return -_solve(shared, at.gradient_shared), np.zeros((len(at.robot), 6))
    robot = _damped(at.robot, damping)
    eliminated = np.linalg.solve(robot, np.swapaxes(at.mixed, 1, 2))
    own = np.linalg.solve(robot, at.gradient_robot[..., None])
    reduced = shared - (at.mixed @ eliminated).sum(0)
    increment = -_solve(reduced, at.gradient_shared - (at.mixed @ own).sum(0)[:, 0])
    return increment, -own[..., 0] - eliminated @ increment


def _damped(information: Array, damping: float) -> Array:
    diagonal = np.diagonal(information, axis1=-2, axis2=-1)
    return information + damping * diagonal[..., None] * np.eye(diagonal.shape[-1])


def _solve(information: Array, gradient: Array) -> Array:
    try:
        return np.asarray(np.linalg.solve(information, gradient))
    except np.linalg.LinAlgError:
        raise SolverFailure("the observations do not determine the unknowns; add samples") from None


def _covariances(at: Linearisation, noise: Noise) -> tuple[Array, Array]:
    """Of the shared unknowns (G, G) and of the robot poses (N, 6, 6), from the inverse of all information."""
    if noise.robot_is_exact:
        return _inverse(at.shared), np.zeros((len(at.robot), 6, 6))
    eliminated = np.linalg.solve(at.robot, np.swapaxes(at.mixed, 1, 2))
    shared = _inverse(at.shared - (at.mixed @ eliminated).sum(0))
    return shared, np.linalg.inv(at.robot) + eliminated @ shared @ np.swapaxes(eliminated, 1, 2)


def _inverse(information: Array) -> Array:
    """The inverse of a symmetric matrix, scaled to a unit diagonal first."""
    scale = 1 / np.sqrt(np.maximum(np.diagonal(information), np.finfo(float).tiny))
    return np.asarray(
        scale[:, None] * np.linalg.pinv(scale[:, None] * information * scale, hermitian=True) * scale
    )


def _redundancy(
    problem: Problem, at: Linearisation, noise: Noise, covariance: Array, robot_covariances: Array
) -> Array:
    """(3,) of the groups observed, rotation, translation; together observations minus unknowns."""
    absorbed = np.einsum("gnij,nji->g", at.own_information, robot_covariances)
    known = len(problem.parameters)
    by_prior = (np.diagonal(covariance)[len(covariance) - known :] / problem.parameter_sigmas**2).sum()
    robot_unknowns = 0 if noise.robot_is_exact else 6 * len(at.robot)
    by_observed = len(covariance) + robot_unknowns - absorbed.sum() - by_prior
    observations = np.array([problem.seen.sum() * problem.observed.shape[-1], *[robot_unknowns / 2] * 2])
    return np.asarray(observations - [by_observed, *absorbed])


def adjust_with_noise(
    problem: Problem,
    state: State,
    noise: Noise,
    known: Sequence[bool] = (False, False, False),
    settings: NoiseSettings = NOISE_ESTIMATION,
) -> Solution:
    """`adjust`, with the noise of each group re-estimated from its residuals.

    A group (observed, rotation, translation) that is `known` or whose redundancy is too small keeps the given
    noise.
    """
    solution = adjust(problem, state, noise)
    iterations = solution.iterations
    floor = np.array([settings.floor_px, settings.floor_rad, settings.floor_m])
    for _ in range(settings.rounds):
        old = np.array([solution.noise.observed, solution.noise.rotation_rad, solution.noise.translation_m])
        free = ~np.asarray(known) & (solution.redundancy >= settings.least_redundancy)
        factors = np.sqrt(solution.at.squares / np.where(free, solution.redundancy, 1.0))
        factors[0] = np.sqrt(_observed_variance_factor(problem, solution, settings))
        factors = np.where(free, np.clip(factors, 1 / settings.largest_change, settings.largest_change), 1.0)
        new = np.where(old > 0, np.maximum(old * factors, floor), 0.0)
        if (np.abs(new - old) <= settings.settled * old).all():
            break
        solution = adjust(problem, solution.state, Noise(*new.tolist()))
        iterations += solution.iterations
    return replace(solution, iterations=iterations)


def _observed_variance_factor(problem: Problem, solution: Solution, settings: NoiseSettings) -> float:
    """By how much the variance of an observed point is larger than assumed.

    Only that part of a sample's residuals matters for X that a motion of the target would explain (6 numbers
    each). A bent target or a wrong lens model errs alike in neighbouring points and puts more there than
    independent noise would; the rest, much more numerous, would then promise a precision that is not there.
    """
    squares, redundancy = solution.at.squares[0], solution.redundancy[0]
    within = problem.seen.sum() * problem.observed.shape[-1] - 6 * len(problem.observed)
    as_motion = redundancy - within
    if min(within, as_motion) >= settings.least_redundancy:
        at = solution.at
        gradients = at.gradients[:, at.robot_columns]
        motions = np.linalg.pinv(at.mixed[:, at.robot_columns], hermitian=True) @ gradients[..., None]
        explained = float((gradients * motions[..., 0]).sum())
        factor_as_motion = explained / as_motion
        factor_within = (squares - explained) / within
        if factor_as_motion > settings.correlated * factor_within:
            return float(factor_as_motion)
    return float(squares / max(redundancy, 1.0))
