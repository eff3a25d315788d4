"""Figures about the results of a group."""

from __future__ import annotations

import numpy as np

from hecbench.estimate import Status, best_first
from hecbench.report.dots import dot_plot
from hecbench.report.panels import panels
from hecbench.report.tables import Group, error_mm


def figures(group: Group) -> list[str]:
    """The SVG figures that suit a group."""
    if group.is_level:
        drawn = error_curves(group)
    else:
        best = best_first(group.estimates)
        drawn = dot_plot(best, None, [estimate.solver for estimate in best])
    return [drawn] if drawn is not None else []


def error_curves(group: Group) -> str | None:
    """For each solver, the share of all runs with a TRE below x; below 1 at the end, runs had no answer."""
    curves = [
        (
            place.solver,
            np.sort([error_mm(run) for run in place.runs if run.status is Status.OK]),
            len(place.runs),
        )
        for place in group.places
    ]
    return panels(curves, group.title)
