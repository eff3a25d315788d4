"""Methods that look at the robot itself: the levels LP, MP, HP beside the paper's Table I, descents, basins."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import Any

import numpy as np

from hecbench import se3
from hecbench.estimate import Estimate, Status
from hecbench.report.svg import COLOURS, panel, svg
from hecbench.report.tables import Table

SUITE, LEVELS = "synthetic", ("LP", "MP", "HP")
_SHOWN_DESCENTS = 40

PAPER = {
    "LP": {
        "EasyHeC": (0.2, 0.5, 1128.2, 8.9, 0.0122, 91.5),
        "IPE": (0.8, 2.1, 8.4, 1.6, 0.0095, 100.0),
        "RGB": (0.2, 103.7, 1870.3, 341.9, 0.3254, 79.0),
        "RGBC": (0.1, 0.3, 1.2, 0.3, 0.0013, 100.0),
        "DRHeC": (0.2, 0.3, 1.3, 0.3, 0.0012, 100.0),
    },
    "MP": {
        "EasyHeC": (0.5, 357.0, 1894.0, 281.5, 0.2899, 91.5),
        "IPE": (3.4, 157.3, 1497.7, 146.9, 0.2719, 96.5),
        "RGB": (711.2, 1694.5, 2199.4, 1257.2, 1.0278, 28.5),
        "RGBC": (0.2, 293.3, 1597.2, 186.2, 0.1703, 99.0),
        "DRHeC": (0.2, 0.9, 1993.7, 76.6, 0.0930, 99.0),
    },
    "HP": {
        "EasyHeC": (29.3, 1343.2, 1986.2, 657.2, 0.6508, 71.0),
        "IPE": (72.9, 496.5, 1872.2, 405.5, 0.5866, 83.5),
        "RGB": (1339.9, 1810.5, 2161.4, 1520.4, 1.1892, 11.0),
        "RGBC": (0.5, 406.8, 1809.5, 332.3, 0.3124, 97.5),
        "DRHeC": (0.5, 210.3, 1626.9, 149.5, 0.2187, 99.5),
    },
}
"""Table I of the paper, 200 runs each: Q1, Q3, largest and mean translation mm, mean rotation rad, success %."""


def sections(estimates: Sequence[Estimate]) -> list[dict[str, Any]]:
    """One section of the report when runs of the suite's start levels are among the estimates."""
    runs = sorted(
        (e for e in estimates if e.suite == SUITE and e.level in LEVELS),
        key=lambda e: (LEVELS.index(str(e.level)), e.solver),
    )
    if not runs:
        return []
    figures = [figure for figure in (descents(runs), basin(runs)) if figure]
    commands = sorted({str(e.provenance.get("command", "")) for e in runs} - {""})
    return [
        {"table": table_one(runs), "figures": figures, "commands": commands, "findings": [], "overlays": []}
    ]


def table_one(runs: Sequence[Estimate]) -> Table:
    """Every run counts: one without an answer stands in the success rate, and its number beside the method."""
    rows = []
    for (level, solver), found in groupby(runs, key=lambda e: (str(e.level), e.solver)):
        group = list(found)
        scored = [e.errors for e in group if e.status is Status.OK and e.errors]
        mm = np.array([errors["camera_T_parent_translation_error_mm"] for errors in scored])
        centre = np.array([errors["translation_error_mm"] for errors in scored])
        rad = np.deg2rad([errors["rotation_error_deg"] for errors in scored])
        name = f"{solver}, {len(scored)} of {len(group)} answered"
        if len(scored):
            within = 100 * ((centre <= 5) & (rad <= 0.01)).sum() / len(group)
            spread = (*np.percentile(mm, [25, 75]), mm.max(), mm.mean(), rad.mean(), within)
            rows.append((level, name, *_cells(spread)))
        else:
            rows.append((level, name, *["-"] * 5, "0"))
    for level in sorted({str(e.level) for e in runs}, key=LEVELS.index):
        rows += [(level, f"paper: {method}", *_cells(numbers)) for method, numbers in PAPER[level].items()]
    rows.sort(key=lambda row: LEVELS.index(row[0]))
    return Table(
        "Starts LP, MP, HP beside the paper's Table I",
        ("level", "method", "Q1 mm", "Q3 mm", "largest mm", "mean mm", "mean rad", "success %"),
        tuple(rows),
        (
            "Translation error of camera_T_base, the paper's unknown. Success here: camera centre within 5 mm and "
            "0.01 rad, of all runs; the paper does not define its own. The pictures are drawn by the renderer that "
            "the method uses: convergence, not accuracy.",
        ),
        left=2,
    )


def _cells(numbers: Sequence[float]) -> list[str]:
    return [f"{number:.0f}" if number >= 100 else f"{number:.3g}" for number in numbers]


def descents(runs: Sequence[Estimate]) -> str | None:
    """Distance of the camera from where it ended, by accepted step, of the runs that tell their path."""
    shown = [e for e in runs if e.diagnostics.get("path") and e.status is Status.OK][:_SHOWN_DESCENTS]
    if not shown:
        return None
    figure, (axes,) = panel(7.0, 3.4, columns=1)
    for estimate in shown:
        poses = se3.exp(np.array([step[2] for step in estimate.diagnostics["path"]]))
        away = 1e3 * np.linalg.norm(poses[:, :3, 3] - poses[-1, :3, 3], axis=1)
        colour = COLOURS[LEVELS.index(str(estimate.level))]
        axes.semilogy(np.arange(len(away))[:-1], np.maximum(away[:-1], 1e-4), color=colour, alpha=0.4, lw=0.8)
    for number, level in enumerate(LEVELS):
        axes.plot([], [], color=COLOURS[number], label=level)
    axes.set(xlabel="accepted step", ylabel="mm from the end", title=f"Descents of {len(shown)} runs")
    axes.grid(True, alpha=0.25)
    axes.legend(frameon=False)
    return svg(figure)


def basin(runs: Sequence[Estimate]) -> str | None:
    """Error at the end over the camera's distance at the start, every run that has both."""
    figure, (axes,) = panel(7.0, 3.4, columns=1)
    drawn = False
    for number, level in enumerate(LEVELS):
        pairs = [
            (_start_distance_mm(e), e.errors["camera_T_parent_translation_error_mm"])
            for e in runs
            if e.level == level and e.status is Status.OK and e.errors and e.diagnostics.get("path")
        ]
        if pairs:
            drawn = True
            start, end = np.array(pairs).T
            axes.loglog(
                start, np.maximum(end, 1e-4), "o", ms=3, color=COLOURS[number], label=level, alpha=0.6
            )
    if not drawn:
        return None
    axes.set(
        xlabel="camera moved from start to end, mm",
        ylabel="error at the end, mm",
        title="Basin: end error over start error",
    )
    axes.grid(True, which="both", alpha=0.25)
    axes.legend(frameon=False)
    return svg(figure)


def _start_distance_mm(estimate: Estimate) -> float:
    path = estimate.diagnostics["path"]
    start, end = se3.exp(np.array([path[0][2], path[-1][2]]))
    return float(1e3 * se3.translation_error_m(start, end))
