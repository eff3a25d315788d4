"""What agrees with the paper's Table I and what does not, from the numbers alone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from hecbench import statistics
from hecbench.estimate import Estimate
from hecbench.report import paper
from hecbench.report.cells import number, p_value
from hecbench.report.scores import (
    FAR_MM,
    SIGNIFICANT,
    Ending,
    base_name,
    by_solver,
    ending,
    ends_mm,
    known_ends,
    mean_mm,
    not_as_published,
    paired,
    paper_name,
)
from hecbench.report.section import Remark, Verdict
from hecbench.report.table_one import stands


def table_one_remarks(runs: Sequence[Estimate]) -> list[Remark]:
    """The order of the methods, and the published means in our intervals."""
    return [*order(runs), *means(runs)]


def order(runs: Sequence[Estimate]) -> list[Remark]:
    """DRHeC against RGBC and RGBC against RGB, or the two that ran, on the same items, for each setting and level."""
    said = []
    for level in paper.LEVELS:
        solvers = by_solver(run for run in runs if run.level == level)
        settings = sorted(
            {name[len(base_name(name)) :] for name in solvers if base_name(name) in paper.ORDER}
        )
        for setting in settings:
            present = [name for name in paper.ORDER if name + setting in solvers]
            for better, worse in pairwise(present):
                pairs = paired(solvers[better + setting], solvers[worse + setting])
                if pairs:
                    said.append(_ordered(level, setting, better, worse, pairs))
    return said


def _ordered(
    level: str, setting: str, better: str, worse: str, pairs: list[tuple[Estimate, Estimate]]
) -> Remark:
    first, second = (ends_mm(side) for side in zip(*pairs, strict=True))
    p = statistics.paired_error_p(first, second)
    won, lost = int((first < second).sum()), int((first > second).sum())
    names = paper.METHODS[better], paper.METHODS[worse]
    theirs = [paper.TABLE_ONE[level][name].mean_mm for name in names]
    medians = [number(float(np.median(side))) for side in (first, second)]
    text = (
        f"{', '.join(filter(None, (level, setting.strip('[]'))))}: {names[0]} is nearer than {names[1]} on {won} of "
        f"{len(pairs)} items and farther on {lost} (median {medians[0]} against {medians[1]} mm, signed ranks "
        f"{p_value(p)}); the paper has means of {theirs[0]:g} and {theirs[1]:g} mm"
    )
    if p >= SIGNIFICANT:
        return Remark(Verdict.OPEN, f"{text}: no difference can be shown here.")
    if won > lost:
        return Remark(Verdict.AGREES, f"{text}: the same order.")
    return Remark(Verdict.DIFFERS, f"{text}: the opposite order.")


def means(runs: Sequence[Estimate]) -> list[Remark]:
    """How many of the published means lie in our intervals, for each setting of the methods."""
    said = []
    settings = sorted({run.solver[len(base_name(run.solver)) :] for run in runs if paper_name(run.solver)})
    for setting in settings:
        places = {}
        for solver, found in by_solver(runs).items():
            if solver != base_name(solver) + setting:
                continue
            for level in paper.LEVELS:
                theirs = paper.TABLE_ONE[level].get(paper_name(solver) or "")
                ours = mean_mm([run for run in found if run.level == level])
                if theirs is not None and not np.isnan(ours.low):
                    places[f"{paper_name(solver)} {level}"] = stands(theirs.mean_mm, ours.low, ours.high)
        if not places:
            continue
        named = {
            place: [name for name, at in places.items() if at == place]
            for place in ("inside", "below", "above")
        }
        text = "; ".join(
            f"{len(names)} {place}" + (f" ({', '.join(names)})" if names else "")
            for place, names in named.items()
        )
        verdict = Verdict.AGREES if len(named["inside"]) == len(places) else Verdict.DIFFERS
        intro = f"{setting.strip('[]')}: of" if setting else "Of"
        said.append(Remark(verdict, f"{intro} {len(places)} published means lie, by our intervals, {text}."))
    return said


def lost_robots(runs: Sequence[Estimate]) -> list[Remark]:
    """How much of a mean comes from runs that did not find the robot, and whether it had left the picture."""
    said = []
    for solver, found in by_solver(runs).items():
        counts = Counter(map(ending, found))
        if counts[Ending.NEAR] == len(found):
            continue
        counted = ", ".join(f"{counts[each]} {each}" for each in Ending if counts[each])
        known = known_ends(found)[:, 0]
        text = f"{solver}: of {len(found)} runs {counted}"
        if known.sum() > 0:
            share = 100 * known[known > FAR_MM].sum() / known.sum()
            text += f"; ends beyond {FAR_MM:g} mm make {share:.0f} % of the mean"
        said.append(
            Remark(
                Verdict.WHY, f"{text}. The median of all is {number(float(np.median(ends_mm(found))))} mm."
            )
        )
    return said


def departures(runs: Sequence[Estimate]) -> list[Remark]:
    """Methods that were not run as their authors published them."""
    return [Remark(Verdict.DIFFERS, text) for text in not_as_published(runs)]
