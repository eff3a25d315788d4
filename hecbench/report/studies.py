"""The studies of methods that look at the robot itself, each with what agrees with the paper and what does not."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from hecbench.estimate import Estimate
from hecbench.report import ablations, curves, keypoints, maskless, paper, variations
from hecbench.report.remarks import departures, lost_robots, table_one_remarks
from hecbench.report.section import Remark, Section
from hecbench.report.table_one import endings, published, table_one
from hecbench.report.tables import Table

SUITES = ("paper", "synthetic")


def is_study(suite: str | None) -> bool:
    """Whether runs of this suite are shown as a study."""
    return suite in SUITES or str(suite).startswith(maskless.SUITE_PREFIX)


def sections(estimates: Sequence[Estimate]) -> list[Section]:
    """The sections of every study that the estimates belong to."""
    found: list[Section] = []
    for suite in sorted({str(e.suite) for e in estimates if is_study(e.suite)}):
        runs = [e for e in estimates if e.suite == suite]
        found += (
            _maskless(suite, runs) if suite.startswith(maskless.SUITE_PREFIX) else _published(suite, runs)
        )
    table = keypoints.table_two("Keypoints beside the paper's Table II", estimates)
    if table is not None:
        found.append(_section(table, keypoints.predicted(estimates), keypoints.remarks(estimates)))
    return found


def _published(suite: str, runs: Sequence[Estimate]) -> list[Section]:
    starts = [run for run in runs if run.level in paper.LEVELS]
    found = []
    if starts:
        levels = [level for level in paper.LEVELS if any(run.level == level for run in starts)]
        table = table_one(f"{suite}: starts LP, MP, HP beside the paper's Table I", starts)
        drawn = (figure(starts, levels) for figure in (curves.error_curves, curves.cost_curves))
        found.append(_section(table, starts, [*departures(starts), *table_one_remarks(starts)], drawn))
        drawn = (figure(starts, levels) for figure in (curves.progress_curves, curves.basin))
        found.append(
            _section(endings(f"{suite}: how the runs end", starts), starts, lost_robots(starts), drawn)
        )
        compared = published(f"{suite}: the paper's numbers in our intervals", starts)
        if compared.rows:
            found.append(_section(compared, starts))
    for option in paper.ABLATIONS:
        table_or_none = ablations.ablation(suite, runs, option)
        if table_or_none is not None:
            of_level = [run for run in runs if run.level == option]
            found.append(_section(table_or_none, of_level, ablations.remarks(runs, option)))
    for heading, make, said in (
        ("more views", variations.views, []),
        ("wrong geometry", variations.mismatch, variations.mismatch_remarks(runs)),
        (
            "changed appearance",
            variations.appearance,
            departures([r for r in runs if r.level not in paper.LEVELS]),
        ),
    ):
        table_or_none = make(f"{suite}: {heading}", runs)
        if table_or_none is not None:
            found.append(_section(table_or_none, runs, said))
    return found


def _maskless(suite: str, runs: Sequence[Estimate]) -> list[Section]:
    table = maskless.outcomes(f"{suite}: right, silent or wrong", runs)
    said = [*maskless.remarks(runs), *departures(runs)]
    return [_section(table, runs, said, (maskless.error_figure(runs),))]


def _section(
    table: Table, runs: Sequence[Estimate], said: Sequence[Remark] = (), drawn: Iterable[str | None] = ()
) -> Section:
    commands = sorted({str(run.provenance.get("command", "")) for run in runs} - {""})
    figures = [figure for figure in drawn if figure is not None]
    return Section(table, remarks=said, figures=figures, commands=commands)
