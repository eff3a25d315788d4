"""What the runs of one method on one level amount to; every run counts, also one without an answer."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from hecbench import se3, statistics
from hecbench.estimate import Estimate, Status, Termination
from hecbench.report import paper
from hecbench.report.cells import NO_ANSWER, interval, number
from hecbench.se3 import Array
from hecbench.statistics import Interval
from hecbench.system.wording import significant

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


def end(run: Estimate) -> tuple[float, float] | None:
    """Translation error of camera_T_base, mm, and rotation error, rad, where a run ended; None where that is not known.

    A run that lost the robot out of the picture has no answer, but it tells where it went.
    """
    if run.status is Status.OK:
        errors = run.errors
        return (errors[ERROR], float(np.deg2rad(errors["rotation_error_deg"]))) if errors else None
    path, truth = run.diagnostics.get("path"), run.provenance.get("truth_parent_T_camera")
    if not path or truth is None or run.termination is not Termination.OUT_OF_FRAME:
        return None
    return off(se3.exp(np.asarray(path[-1][2], float)), truth)


def off(parent_T_camera: ArrayLike, truth: ArrayLike) -> tuple[float, float]:
    """Translation error of camera_T_parent, mm, and rotation error, rad."""
    apart = se3.translation_error_m(se3.inverse(parent_T_camera), se3.inverse(truth))
    return 1e3 * float(apart), float(se3.rotation_error_rad(parent_T_camera, truth))


def ends_mm(runs: Iterable[Estimate]) -> Array:
    """Where every run ended, `NO_ANSWER` where that is not known."""
    found = (end(run) for run in runs)
    return np.array([NO_ANSWER if each is None else each[0] for each in found])


def known_ends(runs: Iterable[Estimate]) -> Array:
    """Translation, mm, and rotation, rad, (N, 2) of the runs whose end is known."""
    return np.array([each for each in map(end, runs) if each is not None]).reshape(-1, 2)


def median_mm(runs: Sequence[Estimate]) -> Interval:
    """Over every run."""
    return statistics.bootstrap(ends_mm(runs), np.median)


def mean_mm(runs: Sequence[Estimate]) -> Interval:
    """Over the runs whose end is known; NaN when there are none."""
    values = known_ends(runs)[:, 0]
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


class Ending(StrEnum):
    """How a run ended."""

    NEAR = "near"
    LOST = "robot lost"
    FAR_IN_FRAME = "far, robot in frame"
    FAR = "far, not reported"
    UNKNOWN = "not known"


def ending(run: Estimate) -> Ending:
    """How a run ended, from where it ended and whether the robot was still in the picture."""
    seen, found = in_frame(run), end(run)
    if seen is False:
        return Ending.LOST
    if found is None:
        return Ending.UNKNOWN
    if found[0] <= FAR_MM:
        return Ending.NEAR
    return Ending.FAR if seen is None else Ending.FAR_IN_FRAME


def rate(flags: Iterable[bool]) -> str:
    """A share with its interval; a dash when there is nothing to count."""
    counted = list(flags)
    if not counted:
        return "-"
    found = statistics.wilson(sum(counted), len(counted))
    return f"{significant(100 * found.value, 3)} [{100 * found.low:.0f}, {100 * found.high:.0f}]"


def rate_where(runs: Iterable[Estimate], test: Callable[[Estimate], bool | None]) -> str:
    """The share of those runs that tell, with how many did when not all."""
    tested = [(run, test(run)) for run in runs]
    known = [value for _, value in tested if value is not None]
    return rate(known) + (f" of {len(known)}" if known and len(known) < len(tested) else "")


def start_mm(run: Estimate) -> float:
    """How far off the start was, the same error as `ERROR`; NaN where that is not known."""
    start, truth = (run.provenance.get(f"{name}_parent_T_camera") for name in ("initial", "truth"))
    return np.nan if start is None or truth is None else off(start, truth)[0]


def paired(first: Sequence[Estimate], second: Sequence[Estimate]) -> list[tuple[Estimate, Estimate]]:
    """The runs of two methods on the same items."""

    def item(run: Estimate) -> tuple[str | None, str | None, str]:
        return run.level, run.item, str(run.provenance.get("recording_sha256"))

    others = {item(run): run for run in second}
    return [(run, others[item(run)]) for run in first if item(run) in others]


SUMMARY_HEADER = (
    "answered",
    "median mm [95 %]",
    "mean mm [95 %]",
    "mean rad",
    f"≤ {SUCCESSES[0][0]:g} mm, {SUCCESSES[0][1]:g} rad, % [95 %]",
)
SUMMARY_NOTE = (
    "Translation error of camera_T_base where every run ended, infinite where that is not known; means are of those "
    "known. A run that lost the robot out of the picture has no answer; it ended where it was last, as in the paper."
)


def summary(runs: Sequence[Estimate]) -> tuple[str, ...]:
    """The cells below `SUMMARY_HEADER`."""
    ends = known_ends(runs)
    return (
        f"{len(answered(runs))} of {len(runs)}",
        interval(median_mm(runs)),
        interval(mean_mm(runs)),
        number(ends[:, 1].mean() if len(ends) else None),
        rate(within(run, *SUCCESSES[0]) for run in runs),
    )


def not_as_published(runs: Sequence[Estimate]) -> list[str]:
    """For each method that was not run as its authors published it, how often, and the first reason."""
    said = []
    for solver, found in by_solver(runs).items():
        reasons = [reason for run in found if (reason := run.diagnostics.get("not_as_published"))]
        if reasons:
            often = f"in {len(reasons)} of {len(found)} runs"
            said.append(f"{solver} is not the published method {often}, first: {reasons[0]}.")
    return said
