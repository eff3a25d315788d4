"""How well all samples agree on one calibration: the first answer to "is my calibration good?"."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity
from hecbench.samples.agreement import LARGEST_SHARE, percent
from hecbench.system.wording import significant

ID = "consistency"


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """The typical residual, as an angle of view turned into mm at the target."""
    if not case.can_be_fitted:
        return None, case
    fit = case.fit
    left = np.inf if fit is None else fit.relative
    if fit is None or left > LARGEST_SHARE:
        summary = "no calibration explains the poses"
        if fit is not None:
            summary += f": the typical sample is left with {percent(left)} of the target's motion"
        action = (
            "check how rotations are written (quaternion order, Euler order, degrees), that poses and images are "
            "of the same moment, and that base_T_flange ends at one frame"
        )
        return Finding(ID, Severity.CRITICAL, summary, action, left, LARGEST_SHARE), replace(
            case, judged=False
        )
    summary = (
        f"the typical sample agrees with one calibration to {significant(fit.in_mm(fit.typical_px))} mm "
        f"({significant(fit.typical_px)} px) across the view"
    )
    return Finding(ID, Severity.OK, summary, value=left, limit=LARGEST_SHARE), case
