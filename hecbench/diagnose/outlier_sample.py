"""Samples that contradict the calibration of all others, and runs of them: a camera or a base that moved."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hecbench.diagnose.case import STANDS_OUT, Examination
from hecbench.diagnose.finding import Finding, Severity, names
from hecbench.system.wording import significant

ID = "outlier_sample"
LIMIT_MM = 12.0
LIMIT_DEG = 2.0
NOTICEABLE_MM = 4.0
NOTICEABLE_DEG = 0.5
CHANCE = 1e-3
"""That a good recording is called bad by its least likely sample."""
_ALIKE = 0.8


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """By how much the target of each sample is displaced from where the robot pose puts it."""
    if case.agreed is None:
        return None, case
    found, agreeing = case.agreed
    millimetres, degrees = found.displacements()
    studentised = found.studentised(agreeing)
    worst = float(np.sqrt(studentised.max()))
    limit = float(np.sqrt(STANDS_OUT))
    odd = ~agreeing & ((millimetres > NOTICEABLE_MM) | (degrees > NOTICEABLE_DEG))
    odd &= ~np.isin(case.ids(np.arange(len(odd))), list(case.explained))
    if not odd.any():
        summary = f"the most different sample is {worst:.1f} times as far off as the typical one"
        severity = Severity.OK if worst <= limit else Severity.INFO
        if severity is Severity.INFO:
            i = int(studentised.argmax())
            summary += f", by {significant(millimetres[i])} mm and {significant(degrees[i])} deg"
        return Finding(ID, severity, summary, value=worst, limit=limit), case
    moved = _moved_together(case, odd)
    concerned = case.ids(odd if moved is None else odd | moved)
    off = f"up to {significant(millimetres[odd].max(), 3)} mm and {significant(degrees[odd].max())} deg"
    if moved is not None:
        summary = (
            f"samples {names(concerned)} follow each other and are displaced alike, by {off}: something moved"
        )
        action = (
            "did the camera, the robot's base or the target move? record anew, or leave these samples out"
        )
        return Finding(ID, Severity.CRITICAL, summary, action, worst, limit, concerned), case
    verb = "contradicts" if len(concerned) == 1 else "contradict"
    summary = f"{names(concerned)} {verb} the other samples: the target is displaced by {off}"
    action = "look at its image and robot pose; leave it out or record it again"
    beyond_chance = studentised > found.exceeded(agreeing, CHANCE)
    far = odd & beyond_chance & ((millimetres > LIMIT_MM) | (degrees > LIMIT_DEG))
    severity = Severity.CRITICAL if far.any() else Severity.WARNING
    return Finding(ID, severity, summary, action, worst, limit, concerned), case


def _moved_together(case: Examination, odd: NDArray[np.bool_]) -> NDArray[np.bool_] | None:
    """Samples next to each other of which two or more stand out and all are displaced alike in the image."""
    assert case.agreed is not None
    found, _ = case.agreed
    shifts = found.shifts_px
    sizes = np.linalg.norm(shifts, axis=1)
    clear = sizes > 2 * np.median(sizes)
    for i in np.flatnonzero(odd[:-1] & odd[1:]).tolist():
        direction = (shifts[i] + shifts[i + 1]) / max(float(np.linalg.norm(shifts[i] + shifts[i + 1])), 1e-12)
        alike = clear & (shifts @ direction > _ALIKE * sizes)
        if not (alike[i] and alike[i + 1]):
            continue
        first, last = i, i + 1
        while first > 0 and alike[first - 1]:
            first -= 1
        while last + 1 < len(alike) and alike[last + 1]:
            last += 1
        run = np.zeros(len(alike), bool)
        run[first : last + 1] = True
        return run
    return None
