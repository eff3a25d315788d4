"""Numbers as the text of table cells."""

from __future__ import annotations

import numpy as np

from hecbench.statistics import Interval
from hecbench.system.wording import significant

ABSENT = "-"
NO_ANSWER = 1e12
"""Stands for the error of a run without an answer, so that medians count every run."""


def number(value: float | np.floating | None) -> str:
    """Three digits, two of what is small; a dash for nothing, infinity for a run without an answer."""
    value = np.nan if value is None else float(value)
    if np.isnan(value):
        return ABSENT
    if value >= NO_ANSWER / 1000:
        return "∞"
    return f"{value:.0f}" if abs(value) >= 1000 else significant(value, 2 if abs(value) < 0.01 else 3)


def interval(interval: Interval) -> str:
    """A value and its interval, where it has one."""
    if np.isnan(interval.low) or np.isnan(interval.high):
        return number(interval.value)
    return f"{number(interval.value)} [{number(interval.low)}, {number(interval.high)}]"


def percent(interval: Interval) -> str:
    """The ends of an interval of a rate."""
    return f"[{100 * interval.low:.0f}, {100 * interval.high:.0f}] %"


def p_value(p: float) -> str:
    """A p, not below what is worth telling."""
    return "p\u00a0<\u00a00.001" if p < 0.001 else f"p\u00a0=\u00a0{p:.2g}"
