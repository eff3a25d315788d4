"""A target of another size than declared: it seems to move farther, or less far, than the robot carries it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity

ID = "target_scale"
LIMIT = 0.025
NOTICEABLE = 0.012
_SIGMAS = 3.0


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """The true size over the declared one, with its standard deviation, from the robot's motion."""
    if case.solution is None:
        return None, case
    scale = case.solution.state.scale
    sigma = scale * float(np.sqrt(case.solution.covariance[12, 12])) * case.noise_factor
    deviation = abs(scale - 1)
    summary = f"the robot's motion says that the target is {scale:.4f} +- {sigma:.4f} of the declared size"
    action = f"measure the printed target with a ruler: {scale:.3f} of the declared size is expected"
    if deviation > LIMIT and deviation > _SIGMAS * sigma:
        return Finding(ID, Severity.CRITICAL, summary, action, scale, LIMIT), replace(
            case, size_factor=case.size_factor * scale
        )
    if deviation > NOTICEABLE and deviation > _SIGMAS * sigma:
        return Finding(ID, Severity.WARNING, summary, action, scale, LIMIT), case
    return Finding(ID, Severity.OK, summary, value=scale, limit=LIMIT), case
