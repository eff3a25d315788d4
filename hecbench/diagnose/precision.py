"""What the samples promise: information about X per sample, and the error in the workspace that follows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from hecbench.bundle.model import Problem, State, linearise
from hecbench.diagnose.case import Examination
from hecbench.diagnose.fit import TYPICAL_NOISE
from hecbench.recording import Mounting
from hecbench.se3 import Array
from hecbench.workspace import points_in_parent, squared_displacement


@dataclass(frozen=True, eq=False)
class Precision:
    """At the calibration of the samples that agree, with the target's size as declared.

    Attributes:
        information: about [X, Y] of each agreeing sample (M, 12, 12), its robot pose eliminated.
        gradients: (M, 12), which sum to zero.
        points_m: workspace points (K, 3) in the parent frame, where errors count.
        noise_factor: by which the samples are noisier than typical.
    """

    problem: Problem
    state: State
    information: Array
    gradients: Array
    points_m: Array
    noise_factor: float

    def covariance(self, extra: Array | None = None) -> Array:
        """Of X (6, 6), with further information (12, 12) about [X, Y]."""
        total = self.information.sum(0) + (0.0 if extra is None else extra)
        scale = 1 / np.sqrt(np.diagonal(total))
        inverse = np.linalg.pinv(scale[:, None] * total * scale, hermitian=True)
        return np.asarray((scale[:, None] * inverse * scale)[:6, :6] * self.noise_factor**2)

    def expected_mm(self, extra: Array | None = None) -> float:
        """Rms displacement of the workspace points by the error of X, one sigma."""
        return 1e3 * float(np.sqrt(np.einsum("ij,ji->", self._to_points, self.covariance(extra))))

    def displacement_mm(self, twists: Array) -> Array:
        """Rms displacement (M,) of the workspace points by changes of X (M, 6)."""
        return np.asarray(1e3 * np.sqrt(np.einsum("mi,ij,mj->m", twists, self._to_points, twists)))

    @property
    def _to_points(self) -> Array:
        return squared_displacement(self.points_m)


def information_of(problem: Problem, state: State) -> tuple[Array, Array]:
    """Information (N, 12, 12) and gradient (N, 12) of each sample about [X, Y], its robot pose eliminated."""
    at = linearise(problem, state, TYPICAL_NOISE)
    eliminated = at.mixed @ np.linalg.inv(at.robot)
    information = at.information - eliminated @ np.swapaxes(at.mixed, 1, 2)
    return information, at.gradients - (eliminated @ at.gradient_robot[..., None])[..., 0]


@lru_cache(maxsize=1)
def precision(case: Examination) -> Precision | None:
    """None when there is no calibration."""
    if case.agreed is None or case.solution is None:
        return None
    found, agreeing = case.agreed
    problem = replace(found.subset(agreeing).problem, free_scale=False)
    state = case.solution.state
    information, gradients = information_of(problem, state)
    points = points_in_parent(problem.base_T_flange, case.recording.mounting is Mounting.EYE_IN_HAND)
    return Precision(problem, state, information, gradients, points, case.noise_factor)
