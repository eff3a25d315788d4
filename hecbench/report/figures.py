"""Figures about the results of a group."""

from __future__ import annotations

import numpy as np

from hecbench.estimate import Status
from hecbench.report.svg import COLOURS, DARK, LIGHT, panel, svg
from hecbench.report.tables import Group, error_mm


def figures(group: Group) -> list[str]:
    """The SVG figures that suit a group."""
    if group.is_level:
        return [error_curves(group)] if any(e.errors for e in group.estimates) else []
    return [held_out_bars(group)] if any(e.held_out for e in group.estimates) else []


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


def held_out_bars(group: Group) -> str:
    """Held-out prediction of each solver with its 95 % interval, in px where there are pixels, else in mm."""
    with_folds = [e for e in group.estimates if e.held_out]
    in_pixels = any("reprojection_px" in (e.held_out or {}) for e in with_folds)
    name, unit = ("reprojection_px", "px") if in_pixels else ("target_mm", "mm")
    shown = [(e.solver, e.held_out) for e in with_folds if e.held_out and name in e.held_out]
    shown.sort(key=lambda row: row[1][name], reverse=True)
    figure, (axes,) = panel(7.0, 0.9 + 0.28 * len(shown), columns=1)
    for row, (_, held_out) in enumerate(shown):
        axes.plot(held_out[f"{name}_interval"], [row, row], color=LIGHT, linewidth=3, solid_capstyle="butt")
        axes.plot([held_out[name]], [row], "o", color=DARK, markersize=5)
    axes.set_yticks(range(len(shown)), [solver for solver, _ in shown])
    axes.set(xlabel=f"held-out prediction, rms {unit}, with 95 % interval", title=group.title)
    axes.set_xlim(left=0)
    axes.grid(True, axis="x", alpha=0.25)
    return svg(figure)


def _dash(number: int) -> str:
    return ("-", "--", ":", "-.")[number // len(COLOURS) % 4]
