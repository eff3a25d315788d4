"""The command line: verbs only. Each reads its arguments, calls one function of the framework, prints the
answer.

stdout carries the answer (with --json nothing but JSON), stderr progress and messages. What takes long to
import is imported by the verb that uses it.
"""

from __future__ import annotations

import os
import shlex
import sys
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hecbench import __version__
from hecbench.commands import console
from hecbench.errors import HecbenchError, InputError

if TYPE_CHECKING:
    from hecbench.running.runner import Task
    from hecbench.running.solving import Options

COMMAND_GROUP = "hecbench.commands"
"""Entry points of further verbs, loaded when they are named."""


class _Verbs(click.Group):
    """The verbs of this file and those of installed packages."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return sorted({*super().list_commands(ctx), *metadata.entry_points(group=COMMAND_GROUP).names})

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if (command := super().get_command(ctx, cmd_name)) is not None:
            return command
        found = list(metadata.entry_points(group=COMMAND_GROUP, name=cmd_name))
        return found[0].load() if found else None


def main() -> None:
    """Run the command line; errors become one line and an exit code, never a traceback."""
    try:
        code = cli.main(standalone_mode=False)
    except click.ClickException as error:
        error.show()
        code = error.exit_code
    except HecbenchError as error:
        click.echo(f"hecbench: {error}", err=True)
        code = error.exit_code
    except (click.Abort, KeyboardInterrupt):
        click.echo("hecbench: interrupted; results written so far are kept", err=True)
        code = 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 1
    sys.exit(code)


@click.group(cls=_Verbs, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="hecbench")
def cli() -> None:
    """Calibrate hand-eye rigs with every method, measure all by the same rulers, and report."""


_json = click.option("--json", "as_json", is_flag=True, help="Print JSON and nothing else.")
_seed = click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
_solver = click.option(
    "--solver",
    "solvers",
    multiple=True,
    metavar="NAME",
    help="Repeatable; NAME[OPTION=VALUE,...] sets options of it; default: all that can.",
)
_unknown = click.option(
    "--unknown",
    type=click.Choice(["joints", "scale", "focal"]),
    multiple=True,
    help="Solve for this too, by every solver with the option `unknown`; repeatable.",
)
_segmenter = click.option(
    "--segmenter", metavar="NAME", help="Whose masks of the robot are used; default: those of the recording."
)
_folder = click.Path(path_type=Path, file_okay=False)
_file = click.Path(path_type=Path, dir_okay=False)
_any_path = click.Path(path_type=Path)


@cli.command()
@click.option("--out", type=_folder, default=Path("out/demo"), show_default=True)
@click.option(
    "--samples", type=click.IntRange(min=1), default=40, show_default=True, help="Recordings per setting."
)
@_seed
def demo(out: Path, samples: int, seed: int) -> None:
    """Calibrate generated recordings with every ready solver; print the tables and write the report."""
    from hecbench.report import html
    from hecbench.running import planning
    from hecbench.storage import store

    (out / store.FILE_NAME).unlink(missing_ok=True)
    levels = ("tag_2m", "small_tag_2m", "board_2m")
    tasks = planning.suite_tasks("markers", levels, samples, (), seed)
    contents = _run(tasks, out, _options(seed), jobs=os.cpu_count() or 1)
    console.print_tables(contents.estimates)
    click.echo(f"report: {html.write(out).path}")


@cli.command()
@click.option("--kind", help="Only this kind: solver, dataset, suite, ...")
@_json
def plugins(kind: str | None, as_json: bool) -> None:
    """List every plugin, also those that are missing something, broken or in conflict."""
    from hecbench import registry
    from hecbench.report.tables import Table
    from hecbench.specs import Kind

    if kind is not None and kind not in list(Kind):
        raise InputError(f"--kind {kind}: choose one of {', '.join(Kind)}")
    rows = [plugin.row() for plugin in registry.load().select(Kind(kind) if kind else None)]
    if as_json:
        console.print_json(rows)
        return
    header = ("name", "kind", "status", "needs", "detail", "distribution")
    cells = [
        (r["name"], r["kind"] or "?", r["status"], ", ".join(r["needs"]), r["detail"], r["distribution"])
        for r in rows
    ]
    console.print_table(Table("plugins", header, tuple(cells), left=len(header)))


@cli.command()
@click.argument("recording", type=_any_path)
@_solver
@_segmenter
@_unknown
@click.option("--views", type=click.IntRange(min=1), help="Use this many samples, drawn with --seed.")
@click.option("--init", type=_file, help="An estimate to start from instead of initial_parent_T_camera.")
@click.option(
    "--held-out/--no-held-out",
    default=None,
    help="Predict left-out samples; default: where truth is not given.",
)
@click.option("--out", type=_folder, help="Write each estimate to DIR/<solver>.json.")
@console.threads
@console.no_cache
@_seed
@_json
def solve(
    recording: Path,
    solvers: tuple[str, ...],
    segmenter: str | None,
    unknown: tuple[str, ...],
    views: int | None,
    init: Path | None,
    held_out: bool | None,
    out: Path | None,
    seed: int,
    as_json: bool,
) -> None:
    """Calibrate one RECORDING; the best estimate comes first."""
    from hecbench import preparation
    from hecbench.estimate import Status, best_first
    from hecbench.report.tables import Group, table
    from hecbench.running import planning, solving

    loaded = planning.adjusted(preparation.load_recording(recording), views, init, seed)
    specs = planning.with_unknowns(planning.solvers_for(solvers, loaded, segmenter), unknown)
    if not specs:
        raise HecbenchError(
            f"{recording}: no ready solver can use what it offers: {', '.join(sorted(loaded.offers()))}"
        )
    options = _options(seed, held_out, segmenter)
    estimates = best_first(solving.solve(loaded, specs, options, say=console.say))
    for estimate in estimates if out else ():
        estimate.save(Path(str(out)) / f"{estimate.solver}.json")
    if as_json:
        console.print_json([estimate.to_json() for estimate in estimates])
    else:
        console.print_table(table(Group(loaded.name, tuple(estimates), is_level=False)))
        console.print_answer(estimates[0])
    answered = [estimate.status is Status.OK for estimate in estimates]
    if not any(answered) or (solvers and not all(answered)):
        sys.exit(1)


@cli.command()
@click.argument("sources", nargs=-1, required=True, metavar="SUITE|RECORDING...")
@_solver
@_segmenter
@click.option(
    "--level", "levels", multiple=True, metavar="L", help="Level of the suite; repeatable; default: all."
)
@click.option("--samples", type=click.IntRange(min=1), help="Recordings per level; default: the suite's.")
@click.option("--held-out/--no-held-out", default=None, help="As for solve.")
@click.option("--out", type=_folder, help="Default: out/<first source's name>.")
@click.option("--jobs", type=int, default=1, show_default=True, help="Worker processes; -1: one per core.")
@click.option("--executor", metavar="URL", help="A dask scheduler, tcp://host:port, instead of --jobs.")
@click.option("--resume", is_flag=True, help="Go on with what --out holds.")
@console.no_cache
@_seed
@_json
def run(
    sources: tuple[str, ...],
    solvers: tuple[str, ...],
    segmenter: str | None,
    levels: tuple[str, ...],
    samples: int | None,
    held_out: bool | None,
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
    options = _options(seed, held_out, segmenter)
    contents = _run(tasks, out, options, jobs=jobs, executor=executor, resume=resume)
    for sentence in contents.damage:
        console.say(sentence)
    if as_json:
        console.print_json([estimate.to_json() for estimate in contents.estimates])
    else:
        console.print_tables(contents.estimates)
    click.echo(f"results: {out}; see them with: hecbench report {out}", err=True)
    if not any(estimate.parent_T_camera is not None for estimate in contents.estimates):
        sys.exit(1)


@cli.command()
@click.argument("folder", type=_folder, metavar="DIR")
@_json
def report(folder: Path, as_json: bool) -> None:
    """Write DIR/report.html from the results and trials that were left in DIR."""
    from hecbench.report import html

    written = html.write(folder)
    for sentence in written.damage:
        console.say(sentence)
    counts = {"results": written.results, "trials": written.trials}
    if as_json:
        console.print_json({"report": str(written.path), **counts, "damage": written.damage})
    else:
        held = ", ".join(f"{count} {name}" for name, count in counts.items() if count)
        click.echo(f"{written.path}: {held or 'no trial ended with a verdict'}")


@cli.command()
@click.argument("name")
@_json
def conformance(name: str, as_json: bool) -> None:
    """Run the plugin author's checks on the solver NAME."""
    from dataclasses import asdict

    from hecbench import registry
    from hecbench.conformance import check_solver
    from hecbench.report.tables import Table
    from hecbench.specs import Kind, SolverSpec

    checks = check_solver(registry.load().get(Kind.SOLVER, name, SolverSpec))
    if as_json:
        console.print_json([asdict(check) for check in checks])
    else:
        rows = tuple((check.name, "passed" if check.passed else "FAILED", check.detail) for check in checks)
        console.print_table(Table(name, ("check", "outcome", "detail"), rows, left=3))
    if not all(check.passed for check in checks):
        sys.exit(1)


@cli.command()
@_json
def doctor(as_json: bool) -> None:
    """Say what is installed, what is missing and how to get it."""
    from hecbench.commands import doctor as examination
    from hecbench.report.tables import Table

    findings = examination.examine()
    if as_json:
        console.print_json([finding.row() for finding in findings])
        return
    rows = tuple((f.subject, f.state, f.version, f.cure) for f in findings)
    console.print_table(Table("installation", ("what", "state", "version", "how to get it"), rows, left=4))


@cli.command()
@click.argument("recording", type=_any_path)
@console.threads
@console.no_cache
@_json
def check(recording: Path, as_json: bool) -> None:
    """ViewInformation for faults in a RECORDING before anything is solved; exits with 3 on a critical one."""
    from hecbench import diagnose, preparation
    from hecbench.diagnose import Severity
    from hecbench.report.tables import Table

    loaded = preparation.load_recording(recording)
    findings = diagnose.check(loaded)
    if as_json:
        rows = [finding.to_json() for finding in findings]
        console.print_json({"recording": loaded.name, "findings": rows})
    else:
        cells = tuple((f.id, str(f.severity), f.summary, f.action) for f in findings)
        console.print_table(
            Table(loaded.name, ("finding", "severity", "what was found", "what to do"), cells, left=4)
        )
    if any(finding.severity is Severity.CRITICAL for finding in findings):
        sys.exit(3)


@cli.command()
@click.argument("recording", type=_any_path)
@click.option("--estimate", "answer", type=_file, required=True, help="An estimate of this recording.")
@click.option("--out", type=_folder, help="Folder of the pictures; default: out/render/<recording>.")
def render(recording: Path, answer: Path, out: Path | None) -> None:
    """Draw the robot over the images of a RECORDING where an estimate places it."""
    from hecbench import estimate, files, preparation
    from hecbench.report import overlay

    loaded = preparation.load_recording(recording)
    written = overlay.render(
        loaded, estimate.load(answer), out or Path("out/render") / files.safe_name(loaded.name)
    )
    click.echo(f"{written[0].parent}: {len(written)} pictures")


@cli.command(name="import")
@click.argument("source", type=_any_path, metavar="SRC")
@click.argument("destination", type=_folder, metavar="DEST")
@click.option(
    "--format", "format_name", metavar="F", help="A dataset of `hecbench plugins`; default: recognised."
)
@click.option("--urdf", type=_file, help="The robot's model; it is copied with its meshes into DEST.")
def import_recording(source: Path, destination: Path, format_name: str | None, urdf: Path | None) -> None:
    """Read a recording SRC of any known format and write it as a native folder DEST."""
    from hecbench import preparation, registry
    from hecbench.running import planning
    from hecbench.specs import DatasetSpec, Kind
    from hecbench.storage import recording_io

    if recording_io.is_recording(destination):
        raise InputError(f"{destination}: holds a recording already; give another destination")
    if format_name is None:
        loaded = preparation.load_recording(source)
    else:
        loaded = registry.load().get(Kind.DATASET, format_name, DatasetSpec).load(source)
    if urdf is not None:
        loaded = planning.with_robot(loaded, urdf)
    recording_io.save(loaded, destination)
    for note in loaded.notes:
        console.say(note)
    click.echo(f"{destination}: {loaded.name}, {loaded.mounting}, {len(loaded)} samples")


@cli.command()
@click.argument("estimate", type=_file)
@click.option("--to", "format_name", required=True, metavar="F", help="An exporter of `hecbench plugins`.")
@click.option("--out", type=_file, help="Write to this file instead of stdout.")
@click.option("--parent", help="Name of the parent frame; default: the estimate's.")
@click.option("--child", help="Frame to place, such as camera_link; default: the optical frame itself.")
@click.option("--optical", help="Name of the camera's optical frame.")
@click.option(
    "--child-T-optical", "child_T_optical", metavar="'X Y Z QX QY QZ QW'", help="As tf2_echo prints it."
)
@click.option("--other-link", help="The robot's other end, where a format names both.")
@click.option("--marker", help="Name of the target's frame, where a format names it.")
def export(estimate: Path, format_name: str, out: Path | None, **options: str | None) -> None:
    """Write an ESTIMATE in another program's format."""
    from hecbench import estimate as estimates
    from hecbench import files, registry
    from hecbench.specs import ExporterSpec, Kind

    exporter = registry.load().get(Kind.EXPORTER, format_name, ExporterSpec)
    given = {name: value for name, value in options.items() if value is not None}
    text = exporter.write(estimates.load(estimate), given)
    if out is None:
        click.echo(text, nl=not text.endswith("\n"))
    else:
        files.write_text(out, text)
        click.echo(f"{out}: {exporter.summary}")


def _options(seed: int, held_out: bool | None = None, segmenter: str | None = None) -> Options:
    from hecbench.running.solving import Options

    words = ["hecbench", *(word for word in sys.argv[1:] if word != "--resume")]
    return Options(seed=seed, held_out=held_out, command=shlex.join(words), segmenter=segmenter)


def _run(
    tasks: list[Task],
    out: Path,
    options: Options,
    *,
    jobs: int,
    executor: str | None = None,
    resume: bool = False,
) -> Any:
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
