"""Figures about descents: how errors distribute, how the cost falls, how far the camera moves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from hecbench import se3
from hecbench.estimate import Estimate
from hecbench.report.scores import base_name, by_solver, end, ends_mm, known_ends, start_mm
from hecbench.report.svg import COLOURS, legend_beside, panel, svg
from hecbench.se3 import Array

_POINTS = 60
_BASINS_IN_A_ROW = 5
_SMALLEST_MM = 1e-4
_SMALLEST_SHARE = 1e-5
"""Paths tell costs to six digits after the point."""
_DASHES = ("-", "--", ":", "-.")


def error_curves(runs: Sequence[Estimate], levels: Sequence[str]) -> str | None:
    """For each level and method the share of all runs that ended below x; below 1, some ends are not known."""
    shown = [level for level in levels if len(known_ends(run for run in runs if run.level == level))]
    if not shown:
        return None
    figure, axes = panel(3.4 * len(shown) + 2.6, 3.4, columns=len(shown))
    looks = _looks(runs)
    for level, view in zip(shown, axes, strict=True):
        for solver, found in by_solver(run for run in runs if run.level == level).items():
            errors = np.sort(np.maximum(known_ends(found)[:, 0], _SMALLEST_MM))
            share = np.arange(1, len(errors) + 1) / len(found)
            view.step(errors, share, where="post", label=solver, **looks[solver])
        view.set(xscale="log", xlabel="error of camera_T_base, mm", ylim=(0, 1.02), title=level)
        view.grid(True, which="major", alpha=0.25)
    axes[0].set_ylabel("share of all runs below")
    legend_beside(axes)
    return svg(figure)


def cost_curves(runs: Sequence[Estimate], levels: Sequence[str]) -> str | None:
    """Cost over iterations as a share of the first.

    Only methods with one cost throughout, which is positive; the stages of second-order methods are not comparable.
    """
    return _bands(runs, levels, _relative_costs, "cost, share of the first")


def progress_curves(runs: Sequence[Estimate], levels: Sequence[str]) -> str | None:
    """Error of camera_T_base over iterations, of the runs that tell their path, lost ones included."""
    return _bands(runs, levels, _errors_on_the_way, "error of camera_T_base, mm")


def _bands(
    runs: Sequence[Estimate],
    levels: Sequence[str],
    curve_of: Callable[[Estimate], Array | None],
    label: str,
) -> str | None:
    """One panel per level: the median over runs of what they tell, and the middle half of them."""
    curves = {
        (level, solver): np.array([_evenly(curve) for curve in map(curve_of, found) if curve is not None])
        for level in levels
        for solver, found in by_solver(run for run in runs if run.level == level).items()
    }
    curves = {key: found for key, found in curves.items() if len(found)}
    shown = [level for level in levels if any(key[0] == level for key in curves)]
    if not shown:
        return None
    figure, axes = panel(3.4 * len(shown) + 2.6, 3.2, columns=len(shown))
    looks = _looks(runs)
    for level, view in zip(shown, axes, strict=True):
        for (at, solver), found in curves.items():
            if at == level:
                along = np.linspace(0, 100, _POINTS)
                low, middle, high = np.percentile(found, [25, 50, 75], axis=0)
                view.fill_between(along, low, high, color=looks[solver]["color"], alpha=0.1, linewidth=0)
                view.semilogy(along, middle, label=f"{solver}, {len(found)} runs", **looks[solver])
        view.set(xlabel="iterations done, %", title=level)
        view.grid(True, which="major", alpha=0.25)
    axes[0].set_ylabel(label)
    legend_beside(axes)
    return svg(figure)


def _evenly(curve: Array) -> Array:
    """A curve at `_POINTS` equal steps."""
    along, known = np.linspace(0, 1, _POINTS), np.linspace(0, 1, len(curve))
    return np.asarray(np.interp(along, known, curve))


def _relative_costs(run: Estimate) -> Array | None:
    costs = [step[1] for step in run.diagnostics.get("path", ()) if step[1] is not None]
    if len(costs) < 2 or min(costs) < 0 or costs[0] <= 0:
        return None
    return np.maximum(np.asarray(costs, float) / float(costs[0]), _SMALLEST_SHARE)


def _errors_on_the_way(run: Estimate) -> Array | None:
    path, truth = run.diagnostics.get("path", ()), run.provenance.get("truth_parent_T_camera")
    if len(path) < 2 or truth is None:
        return None
    poses = se3.exp(np.array([step[2] for step in path], float))
    errors_mm = 1e3 * se3.translation_error_m(se3.inverse(poses), se3.inverse(truth))
    return np.asarray(np.maximum(errors_mm, _SMALLEST_MM))


def basin(runs: Sequence[Estimate], levels: Sequence[str]) -> str | None:
    """Error at the end over error at the start, one panel per method, every run that has both."""
    known = [run for run in runs if end(run) is not None and np.isfinite(start_mm(run))]
    if not known:
        return None
    solvers = by_solver(known)
    columns = min(len(solvers), _BASINS_IN_A_ROW)
    figure, axes = panel(max(4.0, 2.3 * columns), 2.8, columns, rows=-(-len(solvers) // columns))
    for unused in axes[len(solvers) :]:
        unused.set_axis_off()
    farthest = max(map(start_mm, known))
    limits = _SMALLEST_MM, 2 * ends_mm(known).max()
    for (solver, found), view in zip(solvers.items(), axes, strict=False):
        for number, level in enumerate(levels):
            of_level = [run for run in found if run.level == level]
            ends = np.maximum(ends_mm(of_level), _SMALLEST_MM)
            starts = [start_mm(run) for run in of_level]
            view.plot(starts, ends, "o", ms=2.5, color=COLOURS[number], alpha=0.5, label=level)
        view.set(yscale="log", ylim=limits, xlim=(0, 1.05 * farthest), xlabel="start error, mm")
        view.set_title(solver.replace("[", "\n["), fontsize=8)
        view.grid(True, alpha=0.25)
    axes[0].set_ylabel("end error, mm")
    axes[0].legend(frameon=False, fontsize=8)
    return svg(figure)


def _looks(runs: Sequence[Estimate]) -> dict[str, dict[str, Any]]:
    """The same in all figures: a colour for each method, a dash for its first, second ... setting."""
    bases: dict[str, list[str]] = {}
    for solver in by_solver(runs):
        bases.setdefault(base_name(solver), []).append(solver)
    return {
        solver: {"color": COLOURS[i % len(COLOURS)], "linestyle": _DASHES[j % len(_DASHES)]}
        for i, solvers in enumerate(bases.values())
        for j, solver in enumerate(solvers)
    }
