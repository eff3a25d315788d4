"""Figures about the results of a group."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hecbench.estimate import Status, best_first
from hecbench.report.dots import dot_plot
from hecbench.report.svg import COLOURS, DARK, panel, svg
from hecbench.report.tables import Group, error_mm
from hecbench.se3 import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Curve = tuple[str, Array, int]
"""A solver, the errors of its answers in mm, ascending, and how many runs it had."""
_MOST_TOGETHER, _COLUMNS = 6, 4
_BEHIND = "#d5dbe1"


def figures(group: Group) -> list[str]:
    """The SVG figures that suit a group."""
    if group.is_level:
        return [error_curves(group)] if any(e.errors for e in group.estimates) else []
    best = best_first(group.estimates)
    drawn = dot_plot(best, None, [estimate.solver for estimate in best])
    return [drawn] if drawn is not None else []


def error_curves(group: Group) -> str:
    """For each solver, the share of all runs with a TRE below x; below 1 at the end, runs had no answer.

    More than `_MOST_TOGETHER` solvers get a small panel each, best first, with the others in grey behind it.
    """
    curves = [
        (solver, np.sort([error_mm(run) for run in runs if run.status is Status.OK]), len(runs))
        for solver, runs in group.by_solver.items()
    ]
    if len(curves) > _MOST_TOGETHER:
        return _one_each(curves, group.title)
    figure, (axes,) = panel(7.0, 3.6, columns=1)
    for number, curve in enumerate(curves):
        _draw(axes, curve, COLOURS[number], label=curve[0])
    axes.set(xscale="log", xlabel="TRE, mm", ylabel="share of runs below", ylim=(0, 1.02), title=group.title)
    axes.grid(True, which="both", alpha=0.25)
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False, fontsize=9)
    return svg(figure)


def _one_each(curves: Sequence[Curve], title: str) -> str:
    def median_mm(curve: Curve) -> float:
        _, errors, runs = curve
        return float(errors[runs // 2]) if len(errors) > runs // 2 else np.inf

    ordered = sorted(curves, key=lambda curve: (median_mm(curve), -len(curve[1])))
    rows = -(-len(ordered) // _COLUMNS)
    figure, panels = panel(9.0, 1.7, _COLUMNS, rows)
    for axes, curve in zip(panels, ordered, strict=False):
        for other in ordered:
            _draw(axes, other, _BEHIND, linewidth=0.8)
        _draw(axes, curve, DARK, linewidth=1.8)
        axes.set(xscale="log", ylim=(0, 1.02))
        axes.set_title(curve[0], fontsize=9)
        axes.grid(True, alpha=0.25)
    for axes in panels[len(ordered) :]:
        axes.set_visible(False)
    figure.suptitle(f"{title}: share of runs with a TRE below", fontsize=10)
    figure.supxlabel("TRE, mm", fontsize=9)
    return svg(figure)


def _draw(axes: Axes, curve: Curve, colour: str, **how: Any) -> None:
    _, errors, runs = curve
    axes.step(errors, np.arange(1, len(errors) + 1) / runs, where="post", color=colour, **how)
