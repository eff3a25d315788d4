"""Calibration from photographs without masks: right, refused, failed, and wrong, which must not happen."""

from __future__ import annotations

import re
from collections.abc import Sequence
from enum import StrEnum

import numpy as np

from hecbench import statistics
from hecbench.estimate import Estimate, Status
from hecbench.report.cells import interval, number
from hecbench.report.scores import by_solver, rate
from hecbench.report.section import Remark, Verdict
from hecbench.report.svg import COLOURS, legend_beside, panel, svg
from hecbench.report.table_one import FIRST_LOOK
from hecbench.report.tables import Table

SUITE_PREFIX = "maskless"
RIGHT_MM, RIGHT_DEG = 30.0, 2.0
_NAMED = 5
_ENOUGH = 200
_TICKS_MM = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000)
_CENTRE, _ROTATION = "translation_error_mm", "rotation_error_deg"


class Outcome(StrEnum):
    """What an answer, or none, amounts to."""

    WRONG = "wrong"
    RIGHT = "right"
    REFUSED = "refused"
    FAILED = "failed"


def outcome(run: Estimate) -> Outcome:
    """Right: camera centre within 30 mm and rotation within 2 deg. Only for runs that are `counted`."""
    if run.status is Status.REFUSED:
        return Outcome.REFUSED
    if run.status is not Status.OK:
        return Outcome.FAILED
    assert run.errors
    close = run.errors[_CENTRE] < RIGHT_MM and run.errors[_ROTATION] < RIGHT_DEG
    return Outcome.RIGHT if close else Outcome.WRONG


def counted(runs: Sequence[Estimate]) -> list[Estimate]:
    """The runs that can be judged: all but answers without a known truth."""
    return [run for run in runs if run.status is not Status.OK or run.errors]


def _levels(runs: Sequence[Estimate]) -> list[str]:
    """The levels, those with fewer views first and those without views in their name last."""

    def natural(level: str) -> list[tuple[bool, int, str]]:
        parts = re.findall(r"\d+|\D+", level)
        return [(False, int(part), "") if part.isdecimal() else (True, 0, part) for part in parts]

    return sorted({str(run.level) for run in runs}, key=natural)


def outcomes(title: str, runs: Sequence[Estimate]) -> Table:
    """One row per level and method, the wrong answers first."""
    left_out, runs = len(runs), counted(runs)
    left_out -= len(runs)
    rows: list[tuple[str, ...]] = []
    looks: list[str] = []
    for level in _levels(runs):
        of_level = by_solver(run for run in runs if run.level == level)
        rows += [_row(level, solver, found) for solver, found in of_level.items()]
        looks += [FIRST_LOOK if place == 0 else "" for place in range(len(of_level))]
    header = (
        "level", "method", "wrong with status ok", "runs", "right", "right % [95 %]", "refused", "failed",
        "right or silent % [95 %]", "centre median mm [95 %]", "centre mean mm [95 %]", "rotation median deg",
        "median s",
    )  # fmt: skip
    notes = (
        f"Right: camera centre within {RIGHT_MM:g} mm and rotation within {RIGHT_DEG:g} deg of the truth. Silent: "
        "refused or failed, with a reason; a suite may have levels where nothing else is due. Errors are of the "
        "answered runs, wrong ones included.",
        *([f"{left_out} answers without a known truth are not counted."] if left_out else []),
    )
    return Table(title, header, tuple(rows), notes, left=2, looks=tuple(looks))


def _row(level: str, solver: str, runs: Sequence[Estimate]) -> tuple[str, ...]:
    found = [outcome(run) for run in runs]
    have = [run for run in runs if run.status is Status.OK and run.errors]
    centre = np.array([run.errors[_CENTRE] for run in have if run.errors])
    turned = [run.errors[_ROTATION] for run in have if run.errors]
    return (
        level,
        solver,
        str(found.count(Outcome.WRONG)),
        str(len(runs)),
        str(found.count(Outcome.RIGHT)),
        rate(each is Outcome.RIGHT for each in found),
        str(found.count(Outcome.REFUSED)),
        str(found.count(Outcome.FAILED)),
        rate(each is not Outcome.WRONG for each in found),
        interval(statistics.bootstrap(centre, np.median)) if len(centre) else number(None),
        interval(statistics.bootstrap(centre)) if len(centre) else number(None),
        number(float(np.median(turned)) if turned else None),
        number(float(np.median([run.seconds for run in runs]))),
    )


def remarks(runs: Sequence[Estimate]) -> list[Remark]:
    """First whether anything wrong was answered, for each method over all levels."""
    said = []
    for solver, found in by_solver(counted(runs)).items():
        ends = [outcome(run) for run in found]
        wrong = ends.count(Outcome.WRONG)
        most = statistics.wilson(wrong, len(ends)).high
        bound = f"the rate lies below {100 * most:.1f} % (95 %)"
        text = f"{solver}: wrong answers with status ok: {wrong} of {len(ends)} runs, {bound}."
        if not wrong:
            enough = len(ends) >= _ENOUGH
            more = "" if enough else f" It takes {_ENOUGH} runs without one to rely on it."
            said.append(Remark(Verdict.AGREES if enough else Verdict.OPEN, text + more))
            continue
        places = [
            f"{run.level} item {run.item}"
            for run, end in zip(found, ends, strict=True)
            if end is Outcome.WRONG
        ]
        more = f", and {len(places) - _NAMED} more" if len(places) > _NAMED else ""
        said.append(Remark(Verdict.ALARM, f"{text} They are {', '.join(places[:_NAMED])}{more}."))
    return said


def error_figure(runs: Sequence[Estimate]) -> str | None:
    """The camera centre's error of every answer by level, with the limit of a right one."""
    have = [run for run in runs if run.status is Status.OK and run.errors]
    if not have:
        return None
    levels = _levels(runs)
    figure, (axes,) = panel(8.5, 1.1 + 0.3 * len(levels), columns=1)
    rng = np.random.default_rng(0)
    drawn = [run.errors[_CENTRE] for run in have if run.errors]
    for number_of, (solver, found) in enumerate(by_solver(have).items()):
        heights = [levels.index(str(run.level)) + rng.uniform(-0.25, 0.25) for run in found]
        errors = [run.errors[_CENTRE] for run in found if run.errors]
        axes.plot(
            errors, heights, ".", ms=5, alpha=0.6, color=COLOURS[number_of % len(COLOURS)], label=solver
        )
    axes.axvline(RIGHT_MM, color="#1c2733", linewidth=0.8)
    axes.set_yticks(range(len(levels)), levels)
    axes.set(
        xscale="log", xlabel=f"camera centre, mm; the line: {RIGHT_MM:g} mm", ylim=(len(levels) - 0.5, -0.5)
    )
    axes.set_xticks(_TICKS_MM, [f"{tick:g}" for tick in _TICKS_MM])
    axes.minorticks_off()
    axes.set_xlim(min(0.5, *drawn), max(100.0, *drawn) * 1.2)
    axes.grid(True, axis="x", alpha=0.25)
    legend_beside([axes])
    return svg(figure)
