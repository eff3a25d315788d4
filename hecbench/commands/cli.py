"""The command line: verbs only. Each reads its arguments, calls one function of the framework, prints the
answer.

stdout carries the answer (with --json nothing but JSON), stderr progress and messages. What takes long to
import is imported by the verb that uses it.
"""

from __future__ import annotations

import os
import signal
import sys
from difflib import get_close_matches
from importlib import metadata
from pathlib import Path

import click

from hecbench import __version__
from hecbench.commands import choices, completion, console
from hecbench.commands.calibrate import calibrate
from hecbench.commands.robot import robot
from hecbench.commands.run import demo, run
from hecbench.commands.solve import solve
from hecbench.commands.view import view
from hecbench.errors import HecbenchError, InputError

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

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if self.get_command(ctx, args[0]) is None:
            near = get_close_matches(args[0], self.list_commands(ctx), n=2)
            hint = f", did you mean {' or '.join(near)}?" if near else ": see hecbench --help"
            raise click.UsageError(f"no verb is called '{args[0]}'{hint}", ctx)
        return super().resolve_command(ctx, args)


def main() -> None:
    """Run the command line; errors become one line and an exit code, never a traceback."""
    signal.signal(signal.SIGTERM, _interrupt)
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
    except OSError as error:
        if isinstance(error, BrokenPipeError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        else:  # a full disk, a folder that may not be written
            click.echo(f"hecbench: {error.filename or 'the output'}: {error.strerror or error}", err=True)
        code = 1
    sys.exit(code)


def _interrupt(number: int, frame: object) -> None:
    raise KeyboardInterrupt


@click.group(cls=_Verbs, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="hecbench")
def cli() -> None:
    """Calibrate hand-eye rigs with every method, measure all of them alike, and report."""


for _verb in (calibrate, demo, robot, run, solve, view):
    cli.add_command(_verb)


@cli.command()
@click.option("--kind", help="Only this kind: solver, dataset, suite, ...")
@choices.as_json
def plugins(kind: str | None, as_json: bool) -> None:
    """List every plugin, also those that are missing something, broken or in conflict."""
    from hecbench import registry
    from hecbench.report.tables import Table
    from hecbench.robots import packages
    from hecbench.specs import Kind

    if kind is not None and kind not in list(Kind):
        raise InputError(f"--kind {kind}: choose one of {', '.join(Kind)}")
    rows = [plugin.row() for plugin in registry.load().select(Kind(kind) if kind else None)]
    if kind == Kind.ROBOT:
        rows += [robot.row() for robot in (*packages.of_entry_points(), *packages.of_distributions())]
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
@click.argument("folder", type=choices.FOLDER, metavar="DIR")
@choices.as_json
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
@click.argument("name", shell_complete=completion.plugins())
@click.option("--kind", help="Of plugins of one name, the one of this kind: solver, segmenter, dataset, ...")
@choices.as_json
def conformance(name: str, kind: str | None, as_json: bool) -> None:
    """Run the plugin author's checks on the plugin NAME."""
    from dataclasses import asdict

    from hecbench import registry
    from hecbench.conformance import check_plugin
    from hecbench.report.tables import Table

    checks = check_plugin(registry.load().named(name, kind))
    if as_json:
        console.print_json([asdict(check) for check in checks])
    else:
        rows = tuple((check.name, "passed" if check.passed else "FAILED", check.detail) for check in checks)
        console.print_table(Table(name, ("check", "outcome", "detail"), rows, left=3))
    if not all(check.passed for check in checks):
        sys.exit(1)


@cli.command()
@click.option("--warm", is_flag=True, help="Compile now what the first calibration would have to wait for.")
@choices.as_json
def doctor(warm: bool, as_json: bool) -> None:
    """Say what is installed, what is missing and how to get it."""
    if warm:
        from hecbench.commands.warming import warm as warmed

        for part in warmed():
            console.say(f"{part.subject}: {part.seconds:.1f} s")
    from hecbench.commands import doctor as examination
    from hecbench.report.tables import Table

    findings = examination.examine()
    if as_json:
        console.print_json([finding.row() for finding in findings])
        return
    rows = tuple((f.subject, f.state, f.version, f.cure) for f in findings)
    console.print_table(Table("installation", ("what", "state", "version", "how to get it"), rows, left=4))


@cli.command()
@click.argument("recording", type=choices.ANY_PATH)
@choices.threads
@choices.no_cache
@choices.as_json
def check(recording: Path, as_json: bool) -> None:
    """Look for faults in a RECORDING before anything is solved; exits with 3 on a critical one."""
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
@click.argument("recording", type=choices.ANY_PATH)
@click.option("--estimate", "answer", type=choices.FILE, required=True, help="An estimate of this recording.")
@click.option("--out", type=choices.FOLDER, help="Folder of the pictures; default: out/render/<recording>.")
def render(recording: Path, answer: Path, out: Path | None) -> None:
    """Draw the robot over the images of a RECORDING where an estimate places it."""
    from hecbench import estimate, preparation
    from hecbench.report import overlay
    from hecbench.system import files

    loaded = preparation.load_recording(recording)
    written = overlay.render(
        loaded, estimate.load(answer), out or Path("out/render") / files.safe_name(loaded.name)
    )
    click.echo(f"{written[0].parent}: {len(written)} pictures")


@cli.command(name="import")
@click.argument("source", type=choices.ANY_PATH, metavar="SRC")
@click.argument("destination", type=choices.FOLDER, metavar="DEST")
@click.option(
    "--format",
    "format_name",
    metavar="F",
    shell_complete=completion.plugins("dataset"),
    help="A dataset of `hecbench plugins`; default: recognised.",
)
@click.option("--urdf", type=choices.FILE, help="The robot's model; it is copied with its meshes into DEST.")
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
@click.argument("estimate", type=choices.ANY_PATH)
@click.option(
    "--to",
    "format_name",
    required=True,
    metavar="F",
    shell_complete=completion.plugins("exporter"),
    help="An exporter of `hecbench plugins`.",
)
@click.option("--out", type=choices.FILE, help="Write to this file instead of stdout.")
@click.option("--parent", help="Name of the parent frame; default: the estimate's.")
@click.option("--child", help="Frame to place, such as camera_link; default: the optical frame itself.")
@click.option("--optical", help="Name of the camera's optical frame.")
@click.option(
    "--child-T-optical", "child_T_optical", metavar="'X Y Z QX QY QZ QW'", help="As tf2_echo prints it."
)
@click.option("--other-link", help="The robot's other end, where a format names both.")
@click.option("--marker", help="Name of the target's frame, where a format names it.")
def export(estimate: Path, format_name: str, out: Path | None, **options: str | None) -> None:
    """Write an ESTIMATE in another program's format: a file, or the recommended one of a folder of results."""
    from hecbench import registry
    from hecbench.report import recommended
    from hecbench.specs import ExporterSpec, Kind
    from hecbench.system import files

    exporter = registry.load().get(Kind.EXPORTER, format_name, ExporterSpec)
    given = {name: value for name, value in options.items() if value is not None}
    text = exporter.write(recommended.of(estimate), given)
    if out is None:
        click.echo(text, nl=not text.endswith("\n"))
    else:
        files.write_text(out, text)
        click.echo(f"{out}: {exporter.summary}")
