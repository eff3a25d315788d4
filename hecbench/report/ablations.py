"""Settings of DRHeC one by one, beside the paper's Tables VI to VIII."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hecbench import statistics
from hecbench.estimate import Estimate
from hecbench.report import paper
from hecbench.report.cells import ABSENT, number, p_value
from hecbench.report.scores import (
    SIGNIFICANT,
    SUMMARY_HEADER,
    SUMMARY_NOTE,
    base_name,
    by_solver,
    ends_mm,
    mean_mm,
    options,
    paired,
    summary,
)
from hecbench.report.section import Remark, Verdict
from hecbench.report.table_one import PAPER_LOOK, stands
from hecbench.report.tables import Table

Series = dict[float, list[Estimate]]


def series(runs: Sequence[Estimate], option: str) -> dict[str, Series]:
    """For each combination of the other options, the runs of each value of this one, by value."""
    found: dict[str, Series] = {}
    for solver, of_solver in by_solver(run for run in runs if run.level == option).items():
        settings = options(solver)
        value = _value(settings.pop(option, str(paper.DEFAULTS[option])))
        if value is not None:
            rest = ",".join(f"{name}={setting}" for name, setting in sorted(settings.items()))
            name = base_name(solver) + (f"[{rest}]" if rest else "")
            found.setdefault(name, {}).setdefault(value, []).extend(of_solver)
    return {name: dict(sorted(values.items())) for name, values in found.items()}


def _value(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def ablation(title: str, runs: Sequence[Estimate], option: str) -> Table | None:
    """Every value of an option, ours above the paper's."""
    number_of_table, theirs = paper.ABLATIONS[option]
    found = series(runs, option)
    if not found:
        return None
    rows: list[tuple[str, ...]] = []
    looks: list[str] = []
    for value in sorted({*theirs, *(value for values in found.values() for value in values)}):
        for name, values in found.items():
            if value in values:
                rows.append((_label(option, value), name, *summary(values[value])))
                looks.append("")
        if value in theirs:
            mm, rad = theirs[value]
            cells = (str(paper.ABLATION_RUNS), ABSENT, number(mm), f"{rad:g}", ABSENT)
            rows.append((_label(option, value), "paper: DRHeC", *cells))
            looks.append(PAPER_LOOK)
    header = (option, "method", *SUMMARY_HEADER)
    named = f"{title}: Table {number_of_table}, {option}"
    return Table(named, header, tuple(rows), (SUMMARY_NOTE,), left=2, looks=tuple(looks))


def _label(option: str, value: float) -> str:
    return f"{value:g}" + (" (default)" if value == paper.DEFAULTS[option] else "")


def remarks(runs: Sequence[Estimate], option: str) -> list[Remark]:
    """Whether the paper's best value is ours, its means lie in our intervals, and how noisy its means are."""
    theirs = paper.ABLATIONS[option][1]
    said = []
    for name, values in series(runs, option).items():
        shared = [value for value in theirs if value in values]
        if len(shared) < 2:
            continue
        said.append(_best_value(name, option, values, shared))
        places = {value: stands(theirs[value][0], *_ends(values[value])) for value in shared}
        inside = [f"{value:g}" for value, place in places.items() if place == "inside"]
        verdict = Verdict.AGREES if len(inside) == len(shared) else Verdict.DIFFERS
        text = f"{name}: {len(inside)} of {len(shared)} of the paper's means lie inside our intervals"
        said.append(Remark(verdict, text + (f" ({', '.join(inside)})." if inside else ".")))
    if said:
        same = [paper.ABLATIONS[other][1][paper.DEFAULTS[other]][0] for other in paper.ABLATIONS]
        listed = ", ".join(f"{mm:g}" for mm in same)
        said.append(
            Remark(
                Verdict.WHY,
                f"The paper's default settings stand in its three tables with {listed} mm, each a mean of "
                f"{paper.ABLATION_RUNS} runs: a factor of {max(same) / min(same):.1f} between its entries is chance.",
            )
        )
    return said


def _ends(runs: Sequence[Estimate]) -> tuple[float, float]:
    found = mean_mm(runs)
    return found.low, found.high


def _best_value(name: str, option: str, values: Series, shared: Sequence[float]) -> Remark:
    """Our best median against the value that the paper found best, on the same items."""
    theirs = paper.ABLATIONS[option][1]
    best_there = min(shared, key=lambda value: theirs[value][0])
    best_here = min(shared, key=lambda value: float(np.median(ends_mm(values[value]))))
    if best_here == best_there:
        return Remark(
            Verdict.AGREES,
            f"{name}: the lowest median is at {option} = {best_here:g}, the paper's best value.",
        )
    pairs = paired(values[best_here], values[best_there])
    said = (
        f"{name}: the lowest median is at {option} = {best_here:g}, the paper's best value is {best_there:g}"
    )
    if not pairs:
        return Remark(Verdict.OPEN, f"{said}; no item was run with both.")
    p = statistics.paired_error_p(*(ends_mm(side) for side in zip(*pairs, strict=True)))
    verdict = Verdict.DIFFERS if p < SIGNIFICANT else Verdict.OPEN
    return Remark(verdict, f"{said}; on {len(pairs)} shared items {p_value(p)} (signed ranks).")
