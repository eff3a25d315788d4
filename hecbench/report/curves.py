"""Figures about descents: how errors distribute, how the cost falls, how far the camera moves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.estimate import Estimate, Status
from hecbench.report.scores import answered, base_name, by_solver, errors_mm, no_answer, start_mm
from hecbench.report.svg import COLOURS, legend_beside, panel, svg

Array = NDArray[np.float64]

_SHOWN_DESCENTS = 40
_POINTS = 60
_BASINS_IN_A_ROW = 5
_SMALLEST_MM = 1e-4
_DASHES = ("-", "--", ":", "-.")


def error_curves(runs: Sequence[Estimate], levels: Sequence[str]) -> str | None:
    """For each level and method the share of all runs with an error below x; below 1 at the end, some had no answer."""
    shown = [level for level in levels if any(run.level == level for run in answered(runs))]
    if not shown:
        return None
    figure, axes = panel(3.4 * len(shown) + 2.6, 3.4, columns=len(shown))
    looks = _looks(runs)
    for level, view in zip(shown, axes, strict=True):
        for solver, found in by_solver(run for run in runs if run.level == level).items():
            errors = np.sort(np.maximum(errors_mm(found), _SMALLEST_MM))
            errors = errors[[not no_answer(error) for error in errors]]
            share = np.arange(1, len(errors) + 1) / len(found)
            view.step(errors, share, where="post", label=solver, **looks[solver])
        view.set(xscale="log", xlabel="error of camera_T_base, mm", ylim=(0, 1.02), title=level)
        view.grid(True, which="major", alpha=0.25)
    axes[0].set_ylabel("share of all runs below")
    legend_beside(axes)
    return svg(figure)


def cost_curves(runs: Sequence[Estimate], levels: Sequence[str]) -> str | None:
    """Cost over iterations as a share of the first: median of all runs, and the middle half of them.

    Only methods with one cost throughout, which is positive; the stages of second-order methods are not comparable.
    """
    curves = {
        (level, solver): np.array([curve for curve in map(_relative_cost, found) if curve is not None])
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
                view.fill_between(along, low, high, color=looks[solver]["color"], alpha=0.12, linewidth=0)
                view.semilogy(along, middle, label=f"{solver}, {len(found)} runs", **looks[solver])
        view.set(xlabel="iterations done, %", title=level)
        view.grid(True, which="major", alpha=0.25)
    axes[0].set_ylabel("cost, share of the first")
    legend_beside(axes)
    return svg(figure)


def _relative_cost(run: Estimate) -> Array | None:
    """The cost at `_POINTS` equal steps of a run that tells positive costs throughout."""
    costs = [step[1] for step in run.diagnostics.get("path", ()) if step[1] is not None]
    if len(costs) < 2 or min(costs) <= 0:
        return None
    told = np.linspace(0, 1, len(costs))
    return np.asarray(np.interp(np.linspace(0, 1, _POINTS), told, np.array(costs) / costs[0]))


def descents(runs: Sequence[Estimate], levels: Sequence[str]) -> str | None:
    """Distance of the camera from where it ended, by accepted step, of the runs that tell their path."""
    shown = [e for e in runs if len(e.diagnostics.get("path", ())) > 1 and e.status is Status.OK]
    shown = shown[:: max(1, len(shown) // _SHOWN_DESCENTS)][:_SHOWN_DESCENTS]
    if not shown:
        return None
    figure, (axes,) = panel(7.0, 3.2, columns=1)
    for estimate in shown:
        poses = se3.exp(np.array([step[2] for step in estimate.diagnostics["path"]]))
        away = 1e3 * np.linalg.norm(poses[:, :3, 3] - poses[-1, :3, 3], axis=1)[:-1]
        colour = COLOURS[levels.index(str(estimate.level))]
        axes.semilogy(np.arange(len(away)), np.maximum(away, _SMALLEST_MM), color=colour, alpha=0.4, lw=0.8)
    for number, level in enumerate(levels):
        axes.plot([], [], color=COLOURS[number], label=level)
    axes.set(
        xlabel="step that the run tells", ylabel="mm from the end", title=f"Descents of {len(shown)} runs"
    )
    axes.grid(True, alpha=0.25)
    axes.legend(frameon=False)
    return svg(figure)


def basin(runs: Sequence[Estimate], levels: Sequence[str]) -> str | None:
    """Error at the end over error at the start, one panel per method, every run that has both."""
    known = [run for run in answered(runs) if np.isfinite(start_mm(run))]
    if not known:
        return None
    solvers = by_solver(known)
    columns = min(len(solvers), _BASINS_IN_A_ROW)
    figure, axes = panel(max(4.0, 2.3 * columns), 2.8, columns, rows=-(-len(solvers) // columns))
    for unused in axes[len(solvers) :]:
        unused.set_axis_off()
    farthest = max(map(start_mm, known))
    limits = _SMALLEST_MM, 2 * errors_mm(known).max()
    for (solver, found), view in zip(solvers.items(), axes, strict=False):
        for number, level in enumerate(levels):
            of_level = [run for run in found if run.level == level]
            ends = np.maximum(errors_mm(of_level), _SMALLEST_MM)
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
