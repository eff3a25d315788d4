"""Levels that change one thing about the start level LP: views, wrong geometry, appearance."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from hecbench import statistics
from hecbench.estimate import Estimate
from hecbench.report import paper
from hecbench.report.cells import ABSENT, interval, number
from hecbench.report.scores import (
    ERROR,
    SUMMARY_HEADER,
    SUMMARY_NOTE,
    answered,
    by_solver,
    mean_mm,
    paper_name,
    summary,
)
from hecbench.report.section import Remark, Verdict
from hecbench.report.table_one import FIRST_LOOK, PAPER_LOOK, stands
from hecbench.report.tables import Table
from hecbench.statistics import Interval

UNCHANGED = "LP"
FLOOR = "correspondence_floor_mm"
_NEAR_FLOOR = 1.2
_VIEWS, _MISMATCH = re.compile(r"views_(\d+)$"), re.compile(r"mismatch_(\d+)$")


def numbers(runs: Sequence[Estimate], pattern: re.Pattern[str], unchanged: int) -> dict[str, int]:
    """The levels that a pattern matches with their number, and LP with its own, in the order of the numbers."""
    found = {level: int(match[1]) for level in _levels(runs) if (match := pattern.match(level))}
    if found and UNCHANGED in _levels(runs):
        found[UNCHANGED] = unchanged
    return dict(sorted(found.items(), key=lambda entry: entry[1]))


def _of_level(runs: Sequence[Estimate], level: str, changed: Iterable[str]) -> dict[str, list[Estimate]]:
    """The runs of a level by solver; of the unchanged one only solvers that met a change."""
    solvers = {run.solver for run in runs if str(run.level) in changed}
    return by_solver(run for run in runs if run.level == level and run.solver in solvers)


def _levels(runs: Sequence[Estimate]) -> list[str]:
    return sorted({str(run.level) for run in runs})


def views(title: str, runs: Sequence[Estimate]) -> Table | None:
    """One, three and five views."""
    levels = numbers(runs, _VIEWS, 1)
    if not levels:
        return None
    return _by_level(title, ("views",), {level: (str(count),) for level, count in levels.items()}, runs)


def appearance(title: str, runs: Sequence[Estimate]) -> Table | None:
    """Levels that are neither starts, nor views, geometry or settings of a method."""
    named = {*paper.LEVELS, *paper.ABLATIONS}
    changed = [
        level
        for level in _levels(runs)
        if level not in named and not _VIEWS.match(level) and not _MISMATCH.match(level)
    ]
    if not changed:
        return None
    levels = [UNCHANGED, *changed] if UNCHANGED in _levels(runs) else changed
    return _by_level(title, ("change",), {level: (level,) for level in levels}, runs)


def _by_level(
    title: str, names: tuple[str, ...], labels: dict[str, tuple[str, ...]], runs: Sequence[Estimate]
) -> Table:
    rows: list[tuple[str, ...]] = []
    looks: list[str] = []
    for level, label in labels.items():
        of_level = _of_level(runs, level, {*labels} - {UNCHANGED})
        rows += [(*label, solver, *summary(found)) for solver, found in of_level.items()]
        looks += [FIRST_LOOK if i == 0 else "" for i in range(len(of_level))]
    header = (*names, "method", *SUMMARY_HEADER)
    return Table(title, header, tuple(rows), (SUMMARY_NOTE,), left=len(names) + 1, looks=tuple(looks))


def mismatch(title: str, runs: Sequence[Estimate]) -> Table | None:
    """Wrong geometry, with the floor that no method can be held below, beside the paper's numbers."""
    levels = numbers(runs, _MISMATCH, 0)
    if not levels:
        return None
    rows: list[tuple[str, ...]] = []
    looks: list[str] = []
    for level, pct in levels.items():
        start = len(rows)
        for solver, found in _of_level(runs, level, {*levels} - {UNCHANGED}).items():
            rows.append((f"{pct} %", solver, *summary(found), *_floor_cells(found)))
        looks += [""] * (len(rows) - start)
        if pct in paper.MISMATCH:
            mm, rad = paper.MISMATCH[pct]
            cells = (str(paper.MISMATCH_RUNS), ABSENT, number(mm), number(rad), ABSENT, ABSENT, ABSENT)
            rows.append((f"{pct} %", "paper: DRHeC", *cells))
            looks.append(PAPER_LOOK)
        if len(rows) > start:
            looks[start] += f" {FIRST_LOOK}"
    header = ("geometry off by", "method", *SUMMARY_HEADER, "mean floor mm", "mean / floor [95 %]")
    notes = (
        SUMMARY_NOTE,
        "Floor: the error of the best camera for exact correspondences under the same wrong geometry, mean over the "
        "answered items; what is left there cannot be seen in the picture. The ratio's interval resamples items.",
    )
    return Table(title, header, tuple(rows), notes, left=2, looks=tuple(looks))


def _floor_cells(runs: Sequence[Estimate]) -> tuple[str, str]:
    ratio = floor_ratio(runs)
    if ratio is None:
        return ABSENT, ABSENT
    return number(floors_mm(runs)[:, 1].mean()), interval(ratio)


def floors_mm(runs: Sequence[Estimate]) -> NDArray[np.float64]:
    """Error and floor (N, 2) mm of the answers that know both."""
    pairs = [
        (run.errors[ERROR], run.provenance["facts"][FLOOR])
        for run in answered(runs)
        if run.errors and FLOOR in run.provenance.get("facts", {})
    ]
    return np.array(pairs).reshape(-1, 2)


def floor_ratio(runs: Sequence[Estimate]) -> Interval | None:
    """Mean error over mean floor; the interval resamples items."""
    pairs = floors_mm(runs)
    if not len(pairs):
        return None

    def ratio(chosen: NDArray[np.float64], axis: int = -1) -> NDArray[np.float64]:
        drawn = pairs[chosen.astype(int)].mean(-2)
        return np.asarray(drawn[..., 0] / drawn[..., 1])

    return statistics.bootstrap(np.arange(len(pairs)), ratio)


def mismatch_remarks(runs: Sequence[Estimate]) -> list[Remark]:
    """Whether the paper's means lie in our intervals, and how near the floor a method comes."""
    said = []
    levels = numbers(runs, _MISMATCH, 0)
    for level, pct in levels.items():
        for solver, found in _of_level(runs, level, {*levels} - {UNCHANGED}).items():
            if paper_name(solver) == "DRHeC" and pct in paper.MISMATCH:
                ours, theirs = mean_mm(found), paper.MISMATCH[pct][0]
                place = stands(theirs, ours.low, ours.high)
                text = f"{pct} %, {solver}: mean {interval(ours)} mm; the paper's {theirs:g} mm lies {place}."
                said.append(Remark(Verdict.AGREES if place == "inside" else Verdict.DIFFERS, text))
            if (ratio := floor_ratio(found)) is not None:
                explained = ratio.high < _NEAR_FLOOR
                text = f"{pct} %, {solver}: {interval(ratio)} times the floor: " + (
                    "what remains comes from the wrong geometry itself."
                    if explained
                    else "the wrong geometry does not explain all of it."
                )
                said.append(Remark(Verdict.WHY, text))
    return said
