"""Tables and figures of grasp and insertion trials, beside the paper's Tables IV and V.

Paper: DRHeC, IEEE Transactions on Instrumentation and Measurement 75:7505816, 2026. Trials that share a
calibration are not independent: beside Wilson's interval stands the one that resamples calibrations.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape
from itertools import groupby
from pathlib import Path

import numpy as np

from hecbench import statistics
from hecbench.report.cells import ABSENT
from hecbench.report.section import Section
from hecbench.report.svg import COLOURS, panel, svg
from hecbench.report.tables import Table
from hecbench.storage.trial_record import TASKS, Outcome, TrialRecord, picture_name
from hecbench.system import files
from hecbench.system.wording import significant

PAPER_PCT = {
    "ur5e": {
        "tsai": (5.6, 5.6),
        "daniilidis": (9.3, 9.3),
        "single3d_closed": (3.7, 1.8),
        "single3d_iterative": (96.3, 81.5),
        "wang2024_reconstructed": (24.1, 16.7),
        "easyhec": (42.6, 9.3),
        "drhec": (88.9, 57.4),
    },
    "vs060": {
        "tsai": (11.1, 11.1),
        "daniilidis": (11.1, 11.1),
        "single3d_closed": (38.9, 27.8),
        "single3d_iterative": (94.4, 83.3),
        "wang2024_reconstructed": (44.4, 22.2),
        "easyhec": (55.6, 33.3),
        "drhec": (77.8, 77.8),
    },
}
"""Grasps and insertions, percent, of Tables IV (UR5e, n = 54) and V (VS060, n = 18)."""


def tables(trials: Sequence[TrialRecord]) -> list[Table]:
    """For each arm and clearance the success table, and the paired tests between methods."""
    found = []
    for (robot, clearance_mm), group in _grouped(trials):
        found.append(_success_table(robot, clearance_mm, group))
        if len({trial.method for trial in group}) > 1:
            found.append(_paired_table(robot, clearance_mm, group))
    return found


def sections(trials: Sequence[TrialRecord], folder: Path | None = None) -> list[Section]:
    """What the HTML page shows of trials, one section for each table; the figures follow the first of an arm, and
    the pictures in the folder the first of its clearances.
    """
    found: list[Section] = []
    shown: set[str] = set()
    for (robot, _), group in _grouped(trials):
        first, *others = tables(group)
        commands = sorted({str(t.provenance["command"]) for t in group if t.provenance.get("command")})
        drawn = [] if folder is None or robot in shown else pictures(folder, robot)
        shown.add(robot)
        found.append(Section(first, figures=figures(group) + drawn, commands=commands))
        found += [Section(other) for other in others]
    return found


def pictures(folder: Path, robot: str) -> list[str]:
    """What `hecbench trial` drew of an arm's trials, as HTML that holds the pictures themselves."""
    found = []
    for task in TASKS:
        for suffix, what in (
            (
                "png",
                "what the camera saw, the tag as it was found (red) and where the tool is to end (green)",
            ),
            ("gif", "the motion of one trial in the lab"),
        ):
            path = folder / picture_name(robot, task, suffix)
            if path.is_file():
                data = b64encode(files.read_bytes(path)).decode()
                caption = escape(f"{robot}, {task}: {what}")
                image = f'<img src="data:image/{suffix};base64,{data}" alt="{caption}">'
                found.append(f"{image}<figcaption>{caption}</figcaption>")
    return found


def figures(trials: Sequence[TrialRecord]) -> list[str]:
    """SVG text for each arm and clearance: success against TRE and error at the workpiece, and the margins."""
    found = []
    for (robot, clearance_mm), group in _grouped(trials):
        title = _title(robot, clearance_mm)
        tre = [(t, t.calibration_errors["tre_mm"]) for t in group if "tre_mm" in t.calibration_errors]
        workpiece = [(t, t.object_error_mm) for t in group if t.object_error_mm is not None]
        for name, errors in (("TRE of the calibration", tre), ("error at the workpiece", workpiece)):
            if errors:
                found.append(success_against(errors, name, title))
        found.append(margins(group, title))
    return found


def _grouped(trials: Iterable[TrialRecord]) -> list[tuple[tuple[str, float], list[TrialRecord]]]:
    def place(trial: TrialRecord) -> tuple[str, float]:
        return trial.robot, trial.clearance_mm

    return [(key, list(group)) for key, group in groupby(sorted(trials, key=place), key=place)]


def _title(robot: str, clearance_mm: float) -> str:
    return f"trials: {robot}, radial clearance {clearance_mm:g} mm"


def _success_table(robot: str, clearance_mm: float, trials: Sequence[TrialRecord]) -> Table:
    methods = sorted({trial.method for trial in trials}, key=lambda name: (-_rate(trials, name), name))
    present = [task for task in TASKS if any(trial.task == task for trial in trials)]
    rows = tuple(
        (
            method,
            *(cell for task in present for cell in _task_cells(robot, method, _of(trials, method, task))),
            _median([t.calibration_errors.get("tre_mm") for t in _of(trials, method)]),
            _median([t.calibration_errors.get("translation_error_mm") for t in _of(trials, method)]),
            _median([t.object_error_mm for t in _of(trials, method)]),
        )
        for method in methods
    )
    columns = ("", " Wilson 95 %", " by calibration 95 %", " paper %", " margin median mm")
    header = (
        "method",
        *(f"{task}{column}" for task in present for column in columns),
        "TRE median mm",
        "camera centre median mm",
        "workpiece median mm",
    )
    notes = (
        "Success: nothing touched on the way and the end within the tolerances of docs/trials.md. Trials that share "
        "a calibration fail together: the interval by calibration resamples calibrations, and it has no width "
        "where all of them agree. Workpiece: from where the calibration put the point to reach to where it was.",
    )
    return Table(_title(robot, clearance_mm), header, rows, notes)


def _task_cells(robot: str, method: str, trials: Sequence[TrialRecord]) -> tuple[str, ...]:
    paper = PAPER_PCT.get(robot, {}).get(method)
    shown = ABSENT if paper is None or not trials else f"{paper[TASKS.index(trials[0].task)]:g}"
    if not trials:
        return (ABSENT,) * 5
    successes = [trial.outcome is Outcome.SUCCESS for trial in trials]
    wilson = statistics.wilson(sum(successes), len(successes))
    cluster = statistics.cluster_bootstrap(successes, [trial.calibration for trial in trials])
    return (
        f"{sum(successes)}/{len(successes)} {100 * wilson.value:.1f} %",
        _range(wilson),
        _range(cluster),
        shown,
        _median([trial.margin_mm for trial in trials]),
    )


def _paired_table(robot: str, clearance_mm: float, trials: Sequence[TrialRecord]) -> Table:
    """Every method against the best one on the trials that both made."""
    best = max(sorted({trial.method for trial in trials}), key=lambda name: _rate(trials, name))
    others = sorted({trial.method for trial in trials} - {best})
    rows = []
    for method in others:
        cells = []
        for task in TASKS:
            first, second = (_outcomes(_of(trials, name, task)) for name in (best, method))
            shared = sorted(set(first) & set(second))
            pairs = [(first[key], second[key]) for key in shared]
            wins, losses = sum(a and not b for a, b in pairs), sum(b and not a for a, b in pairs)
            p = statistics.paired_success_p(*zip(*pairs, strict=True)) if pairs else None
            cells += [ABSENT, ABSENT] if p is None else [f"{wins} : {losses}", f"{significant(p)}"]
        rows.append((method, *cells))
    header = ("method", *(f"{task} {column}" for task in TASKS for column in ("won : lost", "p")))
    note = (
        f"Pairs of trials in which only {best}, or only the method, succeeded, and the exact two-sided p (McNemar). "
        "The p takes trials as independent, which trials of one calibration are not."
    )
    return Table(f"{best} against each, {robot}, {clearance_mm:g} mm", header, tuple(rows), (note,))


def success_against(trials: Sequence[tuple[TrialRecord, float]], name: str, title: str) -> str:
    """Share of successes, with Wilson's intervals, in classes of an error in mm."""
    figure, (axes,) = panel(7.0, 3.4, 1)
    edges = np.array([0.0, 0.5, 1, 1.5, 2, 3, 5, 10, 15, 20, 30, 50, 100])
    for number, task in enumerate(TASKS):
        known = [(trial, error) for trial, error in trials if trial.task == task]
        if not known:
            continue
        errors = np.array([error for _, error in known])
        success = np.array([trial.outcome is Outcome.SUCCESS for trial, _ in known])
        which = np.clip(np.digitize(errors, edges) - 1, 0, len(edges) - 1)
        for place in np.unique(which):
            chosen = success[which == place]
            interval = statistics.wilson(int(chosen.sum()), len(chosen))
            x = float(np.median(errors[which == place]))
            axes.plot([x, x], [interval.low, interval.high], color=COLOURS[number], linewidth=2, alpha=0.5)
            label = task if place == which.min() else None
            axes.plot([x], [interval.value], "os"[number], color=COLOURS[number], label=label)
    every = [error for _, error in trials]
    axes.set(xscale="symlog", xlabel=f"{name}, mm", ylabel="share of successes", ylim=(-0.03, 1.03))
    axes.set_xlim(0.7 * min(every) - 0.1, 1.4 * max(every) + 0.1)
    axes.set_title(title)
    axes.legend(frameon=False)
    axes.grid(True, alpha=0.25)
    return svg(figure)


def margins(trials: Sequence[TrialRecord], title: str) -> str:
    """The margin of every trial by method; below zero a tolerance was exceeded."""
    methods = sorted({trial.method for trial in trials}, key=lambda name: _rate(trials, name))
    figure, (axes,) = panel(7.0, 1.2 + 0.34 * len(methods), 1)
    rng = np.random.default_rng(0)
    for number, task in enumerate(TASKS):
        for row, method in enumerate(methods):
            values = [t.margin_mm for t in _of(trials, method, task) if t.margin_mm is not None]
            heights = row + 0.2 * (number - 0.5) * 2 + rng.uniform(-0.1, 0.1, len(values))
            if not values:
                continue
            label = task if task not in axes.get_legend_handles_labels()[1] else None
            axes.plot(values, heights, ".", markersize=4, color=COLOURS[number], alpha=0.6, label=label)
    axes.axvline(0.0, color="#1c2733", linewidth=0.8)
    axes.set_yticks(range(len(methods)), methods)
    axes.set_xscale("symlog", linthresh=1.0)
    axes.set(xlabel="margin, mm", title=title)
    if axes.lines[:-1]:
        axes.legend(frameon=False, loc="center left", bbox_to_anchor=(1.01, 0.5))
    axes.grid(True, axis="x", alpha=0.25)
    return svg(figure)


def _of(trials: Iterable[TrialRecord], method: str, task: str | None = None) -> list[TrialRecord]:
    return [trial for trial in trials if trial.method == method and task in (None, trial.task)]


def _rate(trials: Sequence[TrialRecord], method: str) -> float:
    return float(np.mean([trial.outcome is Outcome.SUCCESS for trial in _of(trials, method)]))


def _outcomes(trials: Iterable[TrialRecord]) -> dict[tuple[str, int, int], bool]:
    return {(t.calibration, t.place, t.seed): t.outcome is Outcome.SUCCESS for t in trials}


def _median(values: Iterable[float | None]) -> str:
    known = [value for value in values if value is not None]
    return f"{significant(np.median(known), 3)}" if known else ABSENT


def _range(interval: statistics.Interval) -> str:
    if not np.isfinite([interval.low, interval.high]).all():
        return ABSENT
    return f"[{100 * interval.low:.0f}, {100 * interval.high:.0f}] %"
