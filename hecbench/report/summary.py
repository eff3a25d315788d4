"""Which solver is first on each level of a study, before all its tables."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hecbench import statistics
from hecbench.estimate import Status
from hecbench.report.cells import ABSENT, interval
from hecbench.report.section import Section
from hecbench.report.tables import Group, Table, error_mm

_FEWEST_LEVELS = 2
"""Of one level its own table says it."""


def summary(groups: Sequence[Group]) -> list[Section]:
    """One section on these levels; none for fewer than two."""
    rows = [_row(group) for group in groups if any(e.errors for e in group.estimates)]
    if len(rows) < _FEWEST_LEVELS:
        return []
    note = (
        "First: the least median TRE of all runs. As good: solvers whose rank is 1 too, since their intervals overlap; "
        "more recordings may distinguish them."
    )
    header = ("level", "first", "as good", "TRE median mm [95 %]", "answered")
    return [Section(Table("Which solver is first", header, tuple(rows), (note,), left=3))]


def _row(group: Group) -> tuple[str, ...]:
    runs = group.by_solver
    medians = {
        name: statistics.bootstrap([error_mm(run) for run in of_solver], np.median)
        for name, of_solver in runs.items()
    }
    ranks = dict(zip(medians, statistics.shared_ranks(list(medians.values())), strict=True))
    first, *others = sorted(medians, key=lambda name: (ranks[name], medians[name].value))
    answered = sum(run.status is Status.OK for run in runs[first])
    if not answered:
        return group.title, "none answered", ABSENT, ABSENT, f"0 of {len(runs[first])}"
    as_good = [name for name in others if ranks[name] == ranks[first]]
    return (
        group.title,
        first,
        ", ".join(as_good) or ABSENT,
        interval(medians[first]),
        f"{answered} of {len(runs[first])}",
    )
