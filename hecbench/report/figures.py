"""Figures as SVG text, drawn with Matplotlib's SVG back end."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np

from hecbench.estimate import Status
from hecbench.report.tables import Group, error_mm

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def figures(group: Group) -> list[str]:
    """The SVG figures that suit a group."""
    if group.is_level:
        return [error_curves(group)] if any(e.errors for e in group.estimates) else []
    return [held_out_bars(group)] if any(e.held_out for e in group.estimates) else []


def error_curves(group: Group) -> str:
    """For each solver, the share of all runs with a TRE below x; a curve that ends below 1 left runs
    unanswered.
    """
    figure, axes = _axes(7.0, 3.6)
    for number, (solver, runs) in enumerate(group.by_solver.items()):
        errors = np.sort([error_mm(run) for run in runs if run.status is Status.OK])
        share = np.arange(1, len(errors) + 1) / len(runs)
        axes.step(errors, share, where="post", label=solver, color=_colour(number), linestyle=_dash(number))
    axes.set(xscale="log", xlabel="TRE, mm", ylabel="share of runs below", ylim=(0, 1.02), title=group.title)
    axes.grid(True, which="both", alpha=0.25)
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False, fontsize=9)
    return _svg(figure)


def held_out_bars(group: Group) -> str:
    """Held-out prediction of each solver with its 95 % interval, in px where there are pixels, else in mm."""
    with_folds = [e for e in group.estimates if e.held_out]
    in_pixels = any("reprojection_px" in (e.held_out or {}) for e in with_folds)
    name, unit = ("reprojection_px", "px") if in_pixels else ("target_mm", "mm")
    shown = [(e.solver, e.held_out) for e in with_folds if e.held_out and name in e.held_out]
    shown.sort(key=lambda row: row[1][name], reverse=True)
    figure, axes = _axes(7.0, 0.9 + 0.28 * len(shown))
    for row, (_, held_out) in enumerate(shown):
        axes.plot(
            held_out[f"{name}_interval"], [row, row], color="#6b7f99", linewidth=3, solid_capstyle="butt"
        )
        axes.plot([held_out[name]], [row], "o", color="#12355b", markersize=5)
    axes.set_yticks(range(len(shown)), [solver for solver, _ in shown])
    axes.set(xlabel=f"held-out prediction, rms {unit}, with 95 % interval", title=group.title)
    axes.set_xlim(left=0)
    axes.grid(True, axis="x", alpha=0.25)
    return _svg(figure)


def _axes(width_inch: float, height_inch: float) -> tuple[Figure, Axes]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_inch, height_inch), layout="constrained")
    axes = figure.add_subplot()
    axes.spines[["top", "right"]].set_visible(False)
    axes.title.set_fontsize(10)
    return figure, axes


def _svg(figure: Figure) -> str:
    """SVG text without a date, so that equal results give equal bytes."""
    import matplotlib

    stream = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "hecbench", "svg.fonttype": "path"}):
        figure.savefig(stream, format="svg", metadata={"Date": None})
    text = stream.getvalue()
    return text[text.index("<svg") :]


_COLOURS = ("#12355b", "#d1495b", "#2e8b57", "#edae49", "#7b4fa3", "#00798c", "#8c564b", "#5c6670")


def _colour(number: int) -> str:
    return _COLOURS[number % len(_COLOURS)]


def _dash(number: int) -> str:
    return ("-", "--", ":", "-.")[number // len(_COLOURS) % 4]
