"""Which solver is first on each level of a study, before all its tables."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hecbench import statistics
from hecbench.estimate import Estimate, Status
from hecbench.report.cells import ABSENT, interval
from hecbench.report.section import Section
from hecbench.report.tables import Group, Place, Table, error_mm

_HEADER = ("level", "first", "TRE median mm [95 %]", "answered", "not distinguished from it")
_NOTE = (
    "First: the least median TRE of all runs. Not distinguished from it: solvers of rank 1 whose errors on the same "
    "recordings do not differ by the signed-rank test (p of 0.05 over all pairs of solvers, Bonferroni: which one is "
    "first was seen on the same recordings); more recordings may separate them."
)


def summary(groups: Sequence[Group]) -> list[Section]:
    """One section on these levels; none where no level has two solvers to compare."""
    compared = [group for group in groups if any(e.errors for e in group.estimates) and len(group.places) > 1]
    if not compared:
        return []
    rows = tuple(_row(group) for group in compared)
    return [Section(Table("Which solver is first", _HEADER, rows, (_NOTE,), left=len(_HEADER), stacks=True))]


def _row(group: Group) -> tuple[str, ...]:
    first, *others = group.places
    if not any(run.status is Status.OK for run in first.runs):
        return group.title, "none answered", ABSENT, first.answered, ABSENT
    if first.rank is None:
        like_it = "not known from fewer than 5 runs"
    else:
        like_it = ", ".join(
            _not_distinguished(
                first,
                [place for place in others if place.rank == first.rank],
                math.comb(len(group.places), 2),
            )
        )
    return group.title, first.solver, interval(first.median_mm), first.answered, like_it or ABSENT


def _not_distinguished(first: Place, rivals: Sequence[Place], pairs: int) -> list[str]:
    reference = _errors_mm(first.runs)
    names = []
    for rival in rivals:
        errors = _errors_mm(rival.runs)
        shared = sorted(reference.keys() & errors.keys())
        p = statistics.paired_error_p([reference[key] for key in shared], [errors[key] for key in shared])
        if not p * pairs < 1 - statistics.CONFIDENCE:
            names.append(rival.solver)
    return names


def _errors_mm(runs: Sequence[Estimate]) -> dict[str, float]:
    """The error of each recording."""
    return {str(run.provenance.get("recording_sha256", run.item)): error_mm(run) for run in runs}
