"""What the runs of one method on one level amount to; every run counts, also one without an answer."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from hecbench import statistics
from hecbench.estimate import Estimate, Status, Termination
from hecbench.report import paper
from hecbench.report.cells import NO_ANSWER, interval, number
from hecbench.report.tables import error_mm
from hecbench.statistics import Interval

Array = NDArray[np.float64]

ERROR = "camera_T_parent_translation_error_mm"
"""Translation of camera_T_base, the unknown of the paper's Table I."""
SUCCESSES = ((5.0, 0.01), (10.0, 0.02), (50.0, 0.1))
"""Millimetres of the camera centre and radians within which a run is a success."""
FAR_MM = 100.0
"""An error from which on a run did not find the robot's pose."""
SIGNIFICANT = 0.05


def base_name(solver: str) -> str:
    """The solver's name without its options."""
    return solver.partition("[")[0]


def options(solver: str) -> dict[str, str]:
    """The options set in a solver's name, ``name[option=value,...]``."""
    inside = solver.partition("[")[2].removesuffix("]")
    return dict(setting.split("=", 1) for setting in inside.split(",") if "=" in setting)


def paper_name(solver: str) -> str | None:
    """What the paper calls the method; None for a method that is not the paper's."""
    return paper.METHODS.get(base_name(solver))


def method_order(solver: str) -> tuple[int, str]:
    """Sorting key: methods that the paper does not have, then the paper's in its own order."""
    names = list(paper.METHODS)
    return (names.index(base_name(solver)) if base_name(solver) in names else -1), solver


def by_solver(runs: Iterable[Estimate]) -> dict[str, list[Estimate]]:
    """The runs of each solver, the paper's methods in its order."""
    found: dict[str, list[Estimate]] = {}
    for run in runs:
        found.setdefault(run.solver, []).append(run)
    return {solver: found[solver] for solver in sorted(found, key=method_order)}


def answered(runs: Iterable[Estimate]) -> list[Estimate]:
    """The runs with an answer that was measured."""
    return [run for run in runs if run.status is Status.OK and run.errors]


def errors_mm(runs: Iterable[Estimate], name: str = ERROR) -> Array:
    """The error of every run, `NO_ANSWER` for one without."""
    return np.array([error_mm(run, name) for run in runs])


def rotations_rad(runs: Iterable[Estimate]) -> Array:
    """Rotation errors of the answers."""
    return np.deg2rad([run.errors["rotation_error_deg"] for run in answered(runs) if run.errors])


def median_mm(runs: Sequence[Estimate], name: str = ERROR) -> Interval:
    """Over every run."""
    return statistics.bootstrap(errors_mm(runs, name), np.median)


def mean_mm(runs: Sequence[Estimate], name: str = ERROR) -> Interval:
    """Over the answers; NaN when there are none."""
    values = errors_mm(answered(runs), name)
    return statistics.bootstrap(values) if len(values) else Interval(np.nan, np.nan, np.nan)


def within(run: Estimate, limit_mm: float, limit_rad: float) -> bool:
    """Whether a run's camera centre and rotation are that near the truth."""
    if run.status is not Status.OK or not run.errors:
        return False
    close = run.errors["translation_error_mm"] <= limit_mm
    return bool(close and np.deg2rad(run.errors["rotation_error_deg"]) <= limit_rad)


def in_frame(run: Estimate) -> bool | None:
    """Whether the robot was in the picture where the run ended; None where the run does not tell."""
    if "in_frame" in run.diagnostics:
        return bool(run.diagnostics["in_frame"])
    return False if run.termination is Termination.OUT_OF_FRAME else None


def rate(flags: Iterable[bool]) -> str:
    """A share with its interval; a dash when there is nothing to count."""
    counted = list(flags)
    if not counted:
        return "-"
    found = statistics.wilson(sum(counted), len(counted))
    return f"{100 * found.value:.3g} [{100 * found.low:.0f}, {100 * found.high:.0f}]"


def rate_where(runs: Iterable[Estimate], test: Callable[[Estimate], bool | None]) -> str:
    """The share of those runs that tell, with how many told when not all did."""
    told = [(run, test(run)) for run in runs]
    known = [value for _, value in told if value is not None]
    return rate(known) + (f" of {len(known)}" if known and len(known) < len(told) else "")


def start_mm(run: Estimate) -> float:
    """How far off the start was, the same error as `ERROR`; NaN where a run does not tell."""
    return float(run.provenance.get("start", {}).get(ERROR, np.nan))


def paired(first: Sequence[Estimate], second: Sequence[Estimate]) -> list[tuple[Estimate, Estimate]]:
    """The runs of two methods on the same items."""

    def item(run: Estimate) -> tuple[str | None, str | None, str]:
        return run.level, run.item, str(run.provenance.get("recording_sha256"))

    others = {item(run): run for run in second}
    return [(run, others[item(run)]) for run in first if item(run) in others]


def no_answer(value: float) -> bool:
    """Whether an error stands for a missing answer."""
    return value >= NO_ANSWER


SUMMARY_HEADER = (
    "answered",
    "median mm [95 %]",
    "mean mm [95 %]",
    "mean rad",
    f"≤ {SUCCESSES[0][0]:g} mm, {SUCCESSES[0][1]:g} rad, % [95 %]",
)
SUMMARY_NOTE = (
    "Translation error of camera_T_base; medians and rates count every run, means are over the answers."
)


def summary(runs: Sequence[Estimate]) -> tuple[str, ...]:
    """The cells below `SUMMARY_HEADER`."""
    rad = rotations_rad(runs)
    return (
        f"{len(answered(runs))} of {len(runs)}",
        interval(median_mm(runs)),
        interval(mean_mm(runs)),
        number(rad.mean() if len(rad) else None),
        rate(within(run, *SUCCESSES[0]) for run in runs),
    )
