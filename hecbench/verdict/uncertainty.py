"""How wrong an answer may be: its covariance, or how much it changes when samples are left out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hecbench import se3
from hecbench.estimate import Estimate
from hecbench.se3 import Array
from hecbench.statistics import CONFIDENCE
from hecbench.verdict.result import Expected
from hecbench.workspace import squared_displacement

_LEAST_FREEDOM = 3.0


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Of a left perturbation ``[phi rad, rho m]`` of parent_T_camera.

    Attributes:
        covariance: (6, 6).
        freedom: degrees of freedom of the estimated noise.
    """

    covariance: Array
    freedom: float

    def rms_m(self, points_m: Array) -> float:
        """Expected rms displacement, m, of points (P, 3) in the parent."""
        return float(np.sqrt(np.trace(self.covariance @ squared_displacement(points_m))))

    def directions(self, points_m: Array) -> float:
        """In how many directions the error of points (P, 3) spreads: 1 when one dominates (Satterthwaite 1946)."""
        product = self.covariance @ squared_displacement(points_m)
        return float(np.trace(product) ** 2 / max(float(np.trace(product @ product)), 1e-300))

    def expected(self, points_m: Array, unexplained_m: float = 0.0) -> Expected:
        """The error at points (P, 3) in the parent, mm, with a 95 % interval.

        The mean square displacement of a Gaussian error is a sum of chi-squares; it is taken as one with the same first
        two moments, over a noise that was estimated itself, which makes it F.

        Args:
            points_m: where the error counts.
            unexplained_m: what independent evidence shows beyond the covariance, rms.
        """
        from scipy.special import fdtri

        tail = (1 - CONFIDENCE) / 2
        ends = fdtri(self.directions(points_m), self.freedom, [tail, 1 - tail])
        value = np.hypot(self.rms_m(points_m), unexplained_m)
        low, high = np.sqrt(ends) * value
        return Expected(1e3 * float(value), 1e3 * float(low), 1e3 * float(high))


def uncertainty(estimate: Estimate, samples: int, points_m: Array) -> Uncertainty | None:
    """The method's covariance, widened where its answers on folds scatter more than chance allows; None without either.

    Args:
        estimate: with an answer.
        samples: that the method could use.
        points_m: (P, 3) where the scatter is compared.
    """
    from scipy.special import fdtri

    scatter = _of_folds(estimate)
    freedom = max(
        6.0 * samples - 12.0, _LEAST_FREEDOM
    )  # residuals of the robot's poses less the unknowns X and Y
    if estimate.covariance is None:
        return scatter
    own = Uncertainty(np.asarray(estimate.covariance, float), freedom)
    if not np.isfinite(own.covariance).all():
        return scatter
    if scatter is None:
        return own
    ratio = (scatter.rms_m(points_m) / max(own.rms_m(points_m), 1e-12)) ** 2
    by_chance = fdtri(scatter.freedom * own.directions(points_m), freedom, CONFIDENCE)
    return Uncertainty(own.covariance * max(1.0, ratio / by_chance), freedom)


def _of_folds(estimate: Estimate) -> Uncertainty | None:
    """The delete-a-group jackknife of the answers on folds (Kott 2001, "The delete-a-group jackknife")."""
    answers = np.asarray((estimate.held_out or {}).get("fold_answers") or np.zeros((0, 4, 4)), float)
    count = len(answers)
    if count <= _LEAST_FREEDOM:
        return None
    twists = se3.log(answers @ se3.inverse(estimate.pose))
    return Uncertainty((count - 1) / count * twists.T @ twists, float(count - 1))
