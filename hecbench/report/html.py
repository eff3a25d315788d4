"""One self-contained HTML page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hecbench import __version__, verdict
from hecbench.errors import InputError
from hecbench.estimate import Estimate, best_first
from hecbench.report import pictures
from hecbench.report.figures import figures
from hecbench.report.first_screen import FirstScreen, first_screen
from hecbench.report.recording_figures import agreement_figure, overlays, residual_figure, scene_figure
from hecbench.report.section import Section
from hecbench.report.studies import is_study
from hecbench.report.studies import sections as sections_of_studies
from hecbench.report.summary import summary
from hecbench.report.tables import Group, groups, table
from hecbench.report.trials import sections as sections_of_trials
from hecbench.storage import evidence, results, store, trial_record
from hecbench.storage.evidence import Evidence
from hecbench.storage.results import VERDICT_NAME
from hecbench.storage.trial_record import TrialRecord
from hecbench.system import files
from hecbench.verdict import Verdict

FILE_NAME = "report.html"
_OF_TRIALS = ("robot", "station", "size", "supersample", "noise", "dynamics")


@dataclass(frozen=True)
class Written:
    """A page and what it was made of: how many results and trials, and one sentence for each damaged line."""

    path: Path
    results: int
    trials: int
    damage: list[str]


def write(folder: Path) -> Written:
    """Read the results and trials in a folder and write ``report.html`` beside them.

    Raises:
        InputError: the folder holds no store, or no whole result.
    """
    has_trials = (folder / trial_record.FILE_NAME).is_file()
    trials = trial_record.read(folder) if has_trials else trial_record.Contents([], [], [])
    judged = verdict.load(folder / VERDICT_NAME) if (folder / VERDICT_NAME).is_file() else None
    alone = has_trials and judged is None and not (folder / store.FILE_NAME).is_file()
    contents = store.Contents([], []) if alone else _results(folder, judged)
    if not contents.estimates and not alone:
        raise InputError(f"{folder}: its store holds no whole result; run again with `hecbench run --resume`")
    damage = [*contents.damage, *trials.damage]
    text = page(
        contents.estimates,
        damage,
        f"hecbench report {folder}",
        lambda sha256: evidence.load(folder, sha256),
        trials.trials,
        folder,
        None if judged is None else first_screen(judged, pictures.load(folder)),
    )
    files.write_text(folder / FILE_NAME, text)
    return Written(folder / FILE_NAME, len(contents.estimates), len(trials.trials), damage)


def _results(folder: Path, judged: Verdict | None) -> store.Contents:
    """The estimates of a verdict and those of a store beside it, or whatever a verb left in the folder."""
    if judged is None:
        return results.read(folder)
    stored = store.read(folder) if (folder / store.FILE_NAME).is_file() else store.Contents([], [])
    return store.Contents([*judged.estimates, *stored.estimates], stored.damage)


def page(
    estimates: Sequence[Estimate],
    damage: Sequence[str],
    command: str,
    evidence: Callable[[str], Evidence | None],
    trials: Sequence[TrialRecord] = (),
    folder: Path | None = None,
    first: FirstScreen | None = None,
) -> str:
    """The HTML text of a report on these estimates and trials; `evidence` gives what a run kept of a recording, by
    hash; pictures of trials are in `folder`; `first` comes before all.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("hecbench.report"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    sections = sections_of_studies(estimates) + sections_of_trials(trials, folder)
    judged = first.verdict.recording if first else None
    ordered = sorted(groups(estimates), key=lambda group: (group.is_level, group.title != judged))
    sections += [_section(group, evidence, has_dots=group.title == judged) for group in ordered]
    sections.sort(key=lambda section: section.folded)
    sections = (
        summary([group for group in ordered if group.is_level and not is_study(group.estimates[0].suite)])
        + sections
    )
    return environment.get_template("report.html.j2").render(
        sections=sections,
        first=first,
        damage=damage,
        command=command,
        runs=len(estimates),
        trials=len(trials),
        methods=len({trial.method for trial in trials}),
        recordings=len({e.provenance.get("recording_sha256") for e in estimates}),
        solvers={e.solver for e in estimates},
        provenance=_provenance(estimates, trials),
    )


def _section(group: Group, evidence: Callable[[str], Evidence | None], has_dots: bool) -> Section:
    """What the page shows of one level or recording; levels of a study are shown there and folded here."""
    drawn = [] if has_dots else figures(group)
    shown = None if group.is_level else evidence(str(group.estimates[0].provenance.get("recording_sha256")))
    best = best_first(group.estimates)
    if shown is not None:
        more = (scene_figure(shown, best[0]), residual_figure(shown, best[0]), agreement_figure(shown, best))
        drawn += [figure for figure in more if figure is not None]
    return Section(
        table(group),
        figures=drawn,
        commands=_values(group.estimates, "command"),
        findings=shown.findings if shown else (),
        overlays=overlays(shown, best[0]) if shown else (),
        folded=group.is_level and is_study(group.estimates[0].suite),
    )


def _provenance(
    estimates: Sequence[Estimate], trials: Sequence[TrialRecord]
) -> list[tuple[str, Sequence[str]]]:
    """What the page says of where it comes from: names and their different values."""
    every: list[Estimate | TrialRecord] = [*estimates, *trials]
    seeds = {*_values(estimates, "seed"), *(str(trial.seed) for trial in trials)}
    return [
        ("hecbench", _values(every, "hecbench") or [__version__]),
        ("libraries", _values(every, "versions")),
        ("seeds", sorted(seeds, key=lambda seed: (len(seed), seed))),
        ("solvers", sorted({e.solver for e in estimates})),
        ("trials of", sorted({trial.method for trial in trials})),
        *((f"{name} of the trials", _values(trials, name)) for name in _OF_TRIALS),
    ]


def _values(origins: Sequence[Estimate | TrialRecord], name: str) -> list[str]:
    """The different values of one entry of the provenance, as text."""

    def text(value: Any) -> str:
        return (
            ", ".join(f"{key} {item}" for key, item in value.items())
            if isinstance(value, dict)
            else str(value)
        )

    return sorted({text(e.provenance[name]) for e in origins if e.provenance.get(name) not in (None, "")})
