"""The start levels LP, MP, HP beside the paper's Table I, and how the runs ended."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hecbench.estimate import Estimate, Termination
from hecbench.report import paper
from hecbench.report.cells import ABSENT, interval, number, p_value
from hecbench.report.scores import (
    FAR_MM,
    SUCCESSES,
    SUMMARY_NOTE,
    Ending,
    answered,
    by_solver,
    ending,
    ends_mm,
    in_frame,
    known_ends,
    mean_mm,
    median_mm,
    paper_name,
    rate,
    rate_where,
    start_mm,
    within,
)
from hecbench.report.tables import Table

PAPER_LOOK = "paper"
FIRST_LOOK = "first"


def table_one(title: str, runs: Sequence[Estimate]) -> Table:
    """Our rows of each method above the paper's row of it."""
    rows: list[tuple[str, ...]] = []
    looks: list[str] = []
    for level in paper.LEVELS:
        solvers = by_solver(run for run in runs if run.level == level)
        if not solvers:
            continue
        start = len(rows)
        for method in (None, *paper.METHODS.values()):
            rows += [_our_row(level, s, found) for s, found in solvers.items() if paper_name(s) == method]
            if method in paper.TABLE_ONE[level]:
                rows.append(_paper_row(level, method))
        looks += [PAPER_LOOK if row[1].startswith("paper: ") else "" for row in rows[start:]]
        looks[start] += f" {FIRST_LOOK}"
    header = (
        "level", "method", "answered", "Q1 mm", "median mm [95 %]", "Q3 mm", "largest mm", "mean mm [95 %]", "mean rad",
        *(f"≤ {mm:g} mm, {rad:g} rad, % [95 %]" for mm, rad in SUCCESSES),
        "in frame %; paper: success %",
    )  # fmt: skip
    notes = (
        SUMMARY_NOTE,
        "≤: camera centre and rotation, of every run; one without an answer is no success. The paper does not define "
        "its success; it cannot be an accuracy, since third quartiles of 0.2 m stand beside 99.5 %.",
        "The pictures are drawn by the renderer that the methods use: convergence, not accuracy.",
    )
    return Table(title, header, tuple(rows), notes, left=2, looks=tuple(looks))


def _our_row(level: str, solver: str, runs: Sequence[Estimate]) -> tuple[str, ...]:
    every, ends = ends_mm(runs), known_ends(runs)
    q1, q3 = np.percentile(every, [25, 75])
    return (
        level,
        solver,
        f"{len(answered(runs))} of {len(runs)}",
        number(q1),
        interval(median_mm(runs)),
        number(q3),
        number(every.max()),
        interval(mean_mm(runs)),
        number(ends[:, 1].mean() if len(ends) else None),
        *(rate(within(run, mm, limit) for run in runs) for mm, limit in SUCCESSES),
        rate_where(runs, in_frame),
    )


def _paper_row(level: str, method: str) -> tuple[str, ...]:
    found = paper.TABLE_ONE[level][method]
    return (
        level,
        f"paper: {method}",
        str(paper.RUNS_PER_LEVEL),
        number(found.q1_mm),
        ABSENT,
        number(found.q3_mm),
        number(found.largest_mm),
        number(found.mean_mm),
        number(found.mean_rad),
        *[ABSENT] * len(SUCCESSES),
        f"{found.success_pct:g}",
    )


def endings(title: str, runs: Sequence[Estimate]) -> Table:
    """How each method's runs end, what carries its mean, and whether the start decided."""
    rows: list[tuple[str, ...]] = []
    looks: list[str] = []
    for level in paper.LEVELS:
        of_level = by_solver(run for run in runs if run.level == level)
        rows += [_ending(level, solver, found) for solver, found in of_level.items()]
        looks += [FIRST_LOOK if number == 0 else "" for number in range(len(of_level))]
    far = f"{FAR_MM:g} mm"
    header = (
        "level", "method", "runs", "near", "robot lost", f"beyond {far}, robot in frame", f"beyond {far}, not reported",
        "end not known", "iterations used up", f"share of the mean from beyond {far} %",
        "start median mm: near", "start median mm: others", "start decides",
    )  # fmt: skip
    notes = (
        f"Near: ended within {far} with the robot in the picture, or not reported. Robot lost: it left the picture. "
        "Start decides: the starts of near runs against those of the others (Mann and Whitney 1947, two-sided).",
    )
    return Table(title, header, tuple(rows), notes, left=2, looks=tuple(looks))


def _ending(level: str, solver: str, runs: Sequence[Estimate]) -> tuple[str, ...]:
    groups: dict[Ending, list[Estimate]] = {each: [] for each in Ending}
    for run in runs:
        groups[ending(run)].append(run)
    near = groups[Ending.NEAR]
    others = [run for each, found in groups.items() if each is not Ending.NEAR for run in found]
    known = known_ends(runs)[:, 0]
    near_starts, other_starts = (np.array([start_mm(run) for run in part]) for part in (near, others))
    return (
        level,
        solver,
        str(len(runs)),
        *(str(len(groups[each])) for each in Ending),
        str(sum(run.termination is Termination.MAX_ITERATIONS for run in runs)),
        f"{100 * known[known > FAR_MM].sum() / known.sum():.0f}"
        if len(known) and known.sum() > 0
        else ABSENT,
        number(np.median(near_starts) if len(near_starts) else None),
        number(np.median(other_starts) if len(other_starts) else None),
        _start_decides(near_starts, other_starts),
    )


def _start_decides(near: np.ndarray, others: np.ndarray) -> str:
    from scipy.stats import mannwhitneyu

    near, others = near[np.isfinite(near)], others[np.isfinite(others)]
    return p_value(mannwhitneyu(near, others).pvalue) if len(near) and len(others) else ABSENT


def published(title: str, runs: Sequence[Estimate]) -> Table:
    """Where the paper's means and success rates lie with respect to our intervals."""
    rows: list[tuple[str, ...]] = []
    looks: list[str] = []
    for level in paper.LEVELS:
        first = True
        for solver, found in by_solver(run for run in runs if run.level == level).items():
            theirs = paper.TABLE_ONE[level].get(paper_name(solver) or "")
            if theirs is None:
                continue
            ours = mean_mm(found)
            known = [flag for flag in map(in_frame, found) if flag is not None]
            rows.append(
                (
                    level,
                    solver,
                    interval(ours),
                    number(theirs.mean_mm),
                    stands(theirs.mean_mm, ours.low, ours.high),
                    rate(known),
                    f"{theirs.success_pct:g}",
                    _rate_stands(theirs.success_pct, known),
                    number(seconds_per_1000(found)),
                    number(paper.SECONDS_PER_1000.get(paper_name(solver) or "")),
                )
            )
            looks.append(FIRST_LOOK if first else "")
            first = False
    header = (
        "level", "method", "our mean mm [95 %]", "paper's mean mm", "the paper's lies",
        "robot in frame % [95 %]", "paper's success %", "the paper's lies",
        "s per 1,000 iterations, median", "paper's, RTX 4090",
    )  # fmt: skip
    notes = (
        "Below: the paper's number is smaller than all of our interval. Its success is not defined; it stands beside "
        "the share of our runs that end with the robot in the picture, the reading that fits its other columns best. "
        "Seconds are of the clock, with whatever else the machine did.",
    )
    return Table(title, header, tuple(rows), notes, left=2, looks=tuple(looks))


def seconds_per_1000(runs: Sequence[Estimate]) -> float | None:
    """Median over the runs that iterated."""
    found = [1e3 * run.seconds / run.iterations for run in runs if run.iterations]
    return float(np.median(found)) if found else None


def stands(value: float, low: float, high: float) -> str:
    """Where a published number lies with respect to an interval."""
    if np.isnan(low) or np.isnan(high):
        return "not comparable"
    return "below" if value < low else "above" if value > high else "inside"


def _rate_stands(percentage: float, flags: Sequence[bool]) -> str:
    from hecbench import statistics

    if not flags:
        return ABSENT
    found = statistics.wilson(sum(flags), len(flags))
    return stands(percentage / 100, found.low, found.high)
