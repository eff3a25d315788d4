"""The verbs that fill a store: `run` and `demo`."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hecbench.commands import choices, completion, console
from hecbench.errors import InputError

if TYPE_CHECKING:
    from hecbench.estimate import Estimate
    from hecbench.running.runner import Task
    from hecbench.running.solving import Options
    from hecbench.storage.store import Contents


@click.command()
@click.option("--out", type=choices.FOLDER, default=Path("out/demo"), show_default=True)
@click.option(
    "--samples", type=click.IntRange(min=1), default=40, show_default=True, help="Recordings per setting."
)
@choices.seed
def demo(out: Path, samples: int, seed: int) -> None:
    """Calibrate photographs of a real robot, with its board and without, then generated recordings.

    Prints the verdict and the tables, and writes the report. Needs neither network nor graphics.
    """
    from hecbench import registry
    from hecbench.commands.calibrate import calibrate_into
    from hecbench.report import html
    from hecbench.report.tables import Group, table
    from hecbench.running import planning
    from hecbench.specs import Kind, SuiteSpec
    from hecbench.storage import store

    levels = ("tag_2m", "small_tag_2m", "board_2m")
    if (out / store.FILE_NAME).exists():
        strange = next(
            (e for e in store.read(out).estimates if (e.suite, e.level in levels) != ("markers", True)), None
        )
        if strange is not None:
            raise InputError(f"{out}: holds results of another run ({strange.recording}); give another --out")
    options = choices.run_options(seed)
    photographs = registry.load().get(Kind.SUITE, "photographs", SuiteSpec)
    recording = photographs.make(photographs.levels[0], 0, seed)
    found, _ = calibrate_into(out, recording, planning.solvers_for((), recording), options)
    console.print_table(table(Group(recording.name, tuple(found.estimates), is_level=False)))
    console.print_verdict(found)
    click.echo()
    tasks = planning.suite_tasks("markers", levels, samples, (), seed)
    contents = _run(tasks, out, options, jobs=os.cpu_count() or 1, resume=True)
    console.print_tables(contents.estimates)
    click.echo(f"report: {html.write(out).path}")


@click.command()
@click.argument(
    "sources",
    nargs=-1,
    required=True,
    metavar="SUITE|RECORDING...",
    shell_complete=completion.plugins("suite", and_files=True),
)
@choices.solvers
@choices.segmenter
@click.option(
    "--level", "levels", multiple=True, metavar="L", help="Level of the suite; repeatable; default: all."
)
@click.option("--samples", type=click.IntRange(min=1), help="Recordings per level; default: the suite's.")
@choices.held_out
@choices.check
@choices.timeout
@choices.memory
@click.option("--out", type=choices.FOLDER, help="Default: out/<first source's name>.")
@click.option("--jobs", type=int, default=1, show_default=True, help="Worker processes; -1: one per core.")
@click.option("--executor", metavar="URL", help="A dask scheduler, tcp://host:port, instead of --jobs.")
@click.option("--resume", is_flag=True, help="Go on with what --out holds.")
@choices.no_cache
@choices.seed
@choices.as_json
def run(
    sources: tuple[str, ...],
    solvers: tuple[str, ...],
    segmenter: str | None,
    levels: tuple[str, ...],
    samples: int | None,
    held_out: bool | None,
    check: bool,
    timeout_s: float | None,
    memory_mb: int | None,
    out: Path | None,
    jobs: int,
    executor: str | None,
    resume: bool,
    seed: int,
    as_json: bool,
) -> None:
    """Run solvers on a SUITE or on RECORDINGs into an append-only store; print the tables."""
    from hecbench.running import planning

    if jobs == 0:
        raise InputError("--jobs 0: give a number of processes, or -1 for one per core")
    tasks = planning.tasks(sources, solvers, levels, samples, seed, segmenter)
    out = out or Path("out") / Path(sources[0]).name
    options = choices.run_options(seed, held_out, segmenter, timeout_s, memory_mb)
    contents = _run(tasks, out, options, jobs=jobs, executor=executor, resume=resume)
    for sentence in contents.damage:
        console.say(sentence)
    critical = check and _print_critical(contents.estimates, out)
    if as_json:
        console.print_json([estimate.to_json() for estimate in contents.estimates])
    else:
        console.print_tables(contents.estimates)
    click.echo(f"results: {out}; see them with: hecbench report {out}", err=True)
    if critical:
        sys.exit(3)
    if not any(estimate.parent_T_camera is not None for estimate in contents.estimates):
        sys.exit(1)


def _print_critical(estimates: Sequence[Estimate], out: Path) -> bool:
    """The critical findings on the recordings of a store, and whether there are any."""
    from hecbench.storage import evidence

    names = {str(e.provenance.get("recording_sha256")): e.recording for e in estimates if e.suite == "files"}
    kept = {name: evidence.load(out, sha256) for sha256, name in names.items()}
    found = [console.print_critical(each.findings, name) for name, each in kept.items() if each is not None]
    return any(found)


def _run(
    tasks: list[Task],
    out: Path,
    options: Options,
    *,
    jobs: int,
    executor: str | None = None,
    resume: bool = False,
) -> Contents:
    """Run tasks into a store under a progress bar on stderr."""
    from dataclasses import replace

    from hecbench.running import runner

    with console.progress(sum(len(task.solvers) for task in tasks)) as advance:
        return runner.run(
            tasks,
            replace(options, stop_on_bad_input=False),
            out=out,
            jobs=jobs,
            executor=executor,
            resume=resume,
            on_result=lambda found: advance(len(found)),
        )
