"""Tables of results as text cells, the same for the terminal and the HTML page."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import groupby

import numpy as np

from hecbench import statistics
from hecbench.estimate import Estimate, Status, best_first, ordering_metric
from hecbench.report.cells import ABSENT, NO_ANSWER, interval, number, percent
from hecbench.report.scores import not_as_published
from hecbench.statistics import Interval

SUCCESS_MM, SUCCESS_RAD = 5.0, 0.01


@dataclass(frozen=True)
class Table:
    """Cells as text. The first `left` columns are words, the rest numbers; `looks` are names of styles, one a row.

    The columns named in `secondary` are shown on the page when they are asked for. Rows of a table that `stacks` are
    blocks of lines on a narrow screen.
    """

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = field(default=())
    left: int = 1
    looks: tuple[str, ...] = ()
    secondary: frozenset[str] = frozenset()
    stacks: bool = False


@dataclass(frozen=True)
class Place:
    """Where a solver stands on a level. No rank where the median has no interval."""

    solver: str
    runs: tuple[Estimate, ...]
    median_mm: Interval
    rank: int | None

    @property
    def answered(self) -> str:
        """How many of its runs have an answer."""
        return f"{sum(run.status is Status.OK for run in self.runs)} of {len(self.runs)}"


@dataclass(frozen=True)
class Group:
    """The estimates of one level of a suite, or of one recording."""

    title: str
    estimates: tuple[Estimate, ...]
    is_level: bool

    @property
    def by_solver(self) -> dict[str, list[Estimate]]:
        """The estimates of each solver, by name."""
        ordered = sorted(self.estimates, key=lambda e: e.solver)
        return {solver: list(group) for solver, group in groupby(ordered, key=lambda e: e.solver)}

    @cached_property
    def places(self) -> list[Place]:
        """The solvers of a level by rank and median TRE, best first."""
        medians = {
            solver: statistics.bootstrap([error_mm(run) for run in runs], np.median)
            for solver, runs in self.by_solver.items()
        }
        known = [solver for solver, median in medians.items() if not np.isnan(median.low)]
        ranks = dict(zip(known, statistics.shared_ranks([medians[solver] for solver in known]), strict=True))
        places = [
            Place(solver, tuple(self.by_solver[solver]), median, ranks.get(solver))
            for solver, median in medians.items()
        ]
        return sorted(places, key=lambda place: (place.rank or len(places) + 1, place.median_mm.value))


def groups(estimates: Iterable[Estimate]) -> list[Group]:
    """One group per level of each suite and per recording given by path, and of these per segmenter."""

    def place(estimate: Estimate) -> tuple[str, str]:
        segmenter = estimate.provenance.get("masks")
        masks = f", masks: {segmenter}" if segmenter else ""
        if estimate.level is not None:
            return f"{estimate.suite}: {estimate.level}{masks}", "level"
        where = f" ({estimate.item})" if estimate.item else ""
        return f"{estimate.recording}{where}{masks}", "item"

    ordered = sorted(estimates, key=place)
    return [
        Group(title, tuple(found), kind == "level") for (title, kind), found in groupby(ordered, key=place)
    ]


def table(group: Group) -> Table:
    """The table of a group: statistics over runs for a level, one row of evidence per solver for a recording."""
    return _level_table(group) if group.is_level else _recording_table(group.title, group.estimates)


def error_mm(estimate: Estimate, name: str = "tre_mm") -> float:
    """One error of a run; very large for a run without an answer, NaN where it was not measured."""
    return float((estimate.errors or {}).get(name, np.nan)) if estimate.status is Status.OK else NO_ANSWER


def succeeded(estimate: Estimate) -> bool:
    """Whether the camera centre and its rotation are within 5 mm and 0.01 rad."""
    if estimate.status is not Status.OK or not estimate.errors:
        return False
    rotation_rad = np.deg2rad(estimate.errors["rotation_error_deg"])
    return bool(estimate.errors["translation_error_mm"] <= SUCCESS_MM and rotation_rad <= SUCCESS_RAD)


def _level_table(group: Group) -> Table:
    rows = []
    for place in group.places:
        runs = place.runs
        answers_mm = [error_mm(run) for run in runs if run.status is Status.OK]
        successes = sum(map(succeeded, runs))
        rows.append(
            (
                place.solver,
                ABSENT if place.rank is None else str(place.rank),
                interval(place.median_mm),
                place.answered,
                number(np.mean(answers_mm) if answers_mm else np.nan),
                number(np.median([error_mm(run, "translation_error_mm") for run in runs])),
                number(np.median([error_mm(run, "rotation_error_deg") for run in runs])),
                f"{successes}/{len(runs)} {percent(statistics.wilson(successes, len(runs)))}",
                number(1e3 * np.median([run.seconds for run in runs])),
            )
        )
    return Table(
        group.title,
        (
            "solver",
            "rank",
            "TRE median mm [95 %]",
            "answered",
            "TRE mean mm",
            "camera centre median mm",
            "rotation median deg",
            f"within {SUCCESS_MM:g} mm, {SUCCESS_RAD:g} rad [95 %]",
            "median ms",
        ),
        tuple(rows),
        (
            "TRE: rms displacement of workspace points. Medians and rates count every run, one without an "
            "answer as infinitely wrong; the mean is over the answers. Ranks are shared where intervals overlap; "
            "fewer than 5 runs have neither.",
            *_reasons(group.estimates),
            *not_as_published(group.estimates),
        ),
    )


def _recording_table(title: str, estimates: Sequence[Estimate]) -> Table:
    """One row per solver: held-out prediction and, where there is truth, errors."""
    estimates = best_first(estimates)
    columns: list[tuple[str, Callable[[Estimate], str]]] = [
        ("held-out px [95 %]", lambda e: _held_out(e, "reprojection_px")),
        ("median px", lambda e: number((e.held_out or {}).get("reprojection_px_median"))),
        ("held-out mm [95 %]", lambda e: _held_out(e, "target_mm")),
        ("median mm", lambda e: number((e.held_out or {}).get("target_mm_median"))),
        ("held-out deg", lambda e: number((e.held_out or {}).get("target_deg"))),
        ("held-out mask IoU [95 %]", lambda e: _held_out(e, "mask_iou")),
        ("held-out contour px [95 %]", lambda e: _held_out(e, "contour_px")),
        ("held-out confirmed", lambda e: number((e.held_out or {}).get("confirmed"))),
        ("confirmed", lambda e: number(e.diagnostics.get("confirmed_at_end"))),
        ("mask IoU", lambda e: number(e.diagnostics.get("mask_iou"))),
        ("masks IoU with given", lambda e: number(e.diagnostics.get("masks_iou_given"))),
        ("masks IoU with truth", lambda e: number((e.errors or {}).get("masks_iou_truth"))),
        ("spread deg", lambda e: number(e.diagnostics.get("target_spread_deg"))),
        ("spread mm", lambda e: number(e.diagnostics.get("target_spread_mm"))),
        ("keypoints median px", lambda e: number(e.diagnostics.get("keypoint_median_px"))),
        ("PCK @50 px", lambda e: number(e.diagnostics.get("pck_50_px"))),
        ("TRE mm", lambda e: number((e.errors or {}).get("tre_mm"))),
        ("pair TRE mm", _pair_tre),
        ("camera centre mm", lambda e: number((e.errors or {}).get("translation_error_mm"))),
        ("rotation deg", lambda e: number((e.errors or {}).get("rotation_error_deg"))),
        ("ms", lambda e: number(1e3 * e.seconds)),
    ]
    cells = {name: [render(e) for e in estimates] for name, render in columns}
    shown = [name for name, _ in columns if any(cell != ABSENT for cell in cells[name])]
    rows = tuple(
        (e.solver, str(e.status), rank, *(cells[name][i] for name in shown))
        for i, (e, rank) in enumerate(zip(estimates, _held_out_ranks(estimates), strict=True))
    )
    notes = (
        *_explained(shown),
        *_ordered_by(estimates),
        *_reasons(estimates),
        *not_as_published(estimates),
    )
    return Table(title, ("solver", "status", "rank", *shown), rows, notes, left=2, secondary=_SECONDARY)


_SECONDARY = frozenset({"median px", "median mm", "held-out deg", "spread deg", "masks IoU with given"})

_EXPLANATIONS = {
    "held-out mm [95 %]": "Held-out: rms prediction of samples left out in 5 folds, the target pose refitted by the "
    "evaluator; an estimate with its own camera is judged with that camera.",
    "held-out contour px [95 %]": "Contour: rms distance of the robot's drawn contour in left-out photographs.",
    "spread mm": "Spread: rms deviation of the constant target pose over all samples, raw robot poses.",
    "pair TRE mm": "Pair TRE: the workspace error of a pose with the camera that the method changed; equal to the TRE "
    "where the camera is the recording's.",
}


def _explained(shown: Sequence[str]) -> list[str]:
    """What the columns of this table mean, no others."""
    return [text for name, text in _EXPLANATIONS.items() if name in shown]


def _ordered_by(estimates: Sequence[Estimate]) -> list[str]:
    """By what the rows are ordered, and which answers come last for want of it."""
    metric = ordering_metric(estimates)
    if metric is None:
        return []
    without = [e.solver for e in estimates if e.status is Status.OK and metric.of(e) is None]
    last = f"; not measured so, therefore last: {', '.join(without)}" if without else ""
    return [f"Ordered by: {metric.label}{last}."]


def _held_out_ranks(estimates: Sequence[Estimate]) -> list[str]:
    """Shared ranks by the metric that orders the rows, where it is a held-out prediction with intervals."""
    metric = ordering_metric(estimates)
    if metric is None or metric.section != "held_out" or not metric.smaller_is_better:
        return [ABSENT] * len(estimates)
    known = [i for i, e in enumerate(estimates) if metric.of(e) is not None]
    ranks = statistics.shared_ranks([held_out_interval(estimates[i], metric.name) for i in known])
    texts = dict(zip(known, map(str, ranks), strict=True))
    return [texts.get(i, ABSENT) for i in range(len(estimates))]


def _reasons(estimates: Iterable[Estimate]) -> list[str]:
    """For each solver with missing answers: how many of each status, and the first reason."""
    reasons: dict[tuple[str, str], list[str]] = {}
    for estimate in estimates:
        if estimate.status is not Status.OK:
            reasons.setdefault((estimate.solver, estimate.status), []).append(str(estimate.reason))
    return [
        f"{solver} {status}{f' {len(found)} times, first' if len(found) > 1 else ''}: {found[0]}"
        for (solver, status), found in sorted(reasons.items())
    ]


def _pair_tre(estimate: Estimate) -> str:
    """Only where the method changed the camera: elsewhere it is the TRE again."""
    errors = estimate.errors or {}
    pair = errors.get("pair_tre_mm")
    return ABSENT if pair is None or pair == errors.get("tre_mm") else number(pair)


def _held_out(estimate: Estimate, name: str) -> str:
    return interval(held_out_interval(estimate, name)) if name in (estimate.held_out or {}) else ABSENT


def held_out_interval(estimate: Estimate, name: str) -> Interval:
    """A held-out number with its interval; NaN ends where it has none."""
    held_out = estimate.held_out or {}
    ends = held_out.get(f"{name}_interval") or (None, None)
    low, high = (np.nan if end is None else end for end in ends)
    return Interval(held_out[name], low, high)
