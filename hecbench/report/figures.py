"""Figures about the results of a group."""

from __future__ import annotations

import numpy as np

from hecbench.estimate import Status, best_first
from hecbench.report.dots import dot_plot
from hecbench.report.svg import COLOURS, panel, svg
from hecbench.report.tables import Group, error_mm


def figures(group: Group) -> list[str]:
    """The SVG figures that suit a group."""
    if group.is_level:
        return [error_curves(group)] if any(e.errors for e in group.estimates) else []
    best = best_first(group.estimates)
    drawn = dot_plot(best, None, [estimate.solver for estimate in best])
    return [drawn] if drawn is not None else []


def error_curves(group: Group) -> str:
    """For each solver, the share of all runs with a TRE below x; below 1 at the end, runs had no answer."""
    figure, (axes,) = panel(7.0, 3.6, columns=1)
    for number, (solver, runs) in enumerate(group.by_solver.items()):
        errors = np.sort([error_mm(run) for run in runs if run.status is Status.OK])
        share = np.arange(1, len(errors) + 1) / len(runs)
        axes.step(
            errors,
            share,
            where="post",
            label=solver,
            color=COLOURS[number % len(COLOURS)],
            linestyle=_dash(number),
        )
    axes.set(xscale="log", xlabel="TRE, mm", ylabel="share of runs below", ylim=(0, 1.02), title=group.title)
    axes.grid(True, which="both", alpha=0.25)
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False, fontsize=9)
    return svg(figure)


def _dash(number: int) -> str:
    return ("-", "--", ":", "-.")[number // len(COLOURS) % 4]
