"""The verb ``hecbench trial``: grasps and insertions with calibrations, in the lab or on a real arm."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hecbench.commands import completion
from hecbench.errors import InputError

if TYPE_CHECKING:
    from hecbench.storage.trial_record import Contents, TrialRecord
    from hecbench_hardware.lab.trial_cell import LabCell
    from hecbench_hardware.trials.runner import Plan

_folder = click.Path(path_type=Path, file_okay=False)
_path = click.Path(path_type=Path)

_OPTIONS = [
    click.option("--estimate", "estimates", type=_path, multiple=True, help="Estimate file or folder of a run."),
    click.option(
        "--solver",
        "solvers",
        multiple=True,
        metavar="NAME",
        shell_complete=completion.plugins("solver"),
        help="Only these of a folder.",
    ),
    click.option("--offset-mm", type=click.FloatRange(min=0), help="Instead: the true calibrations, moved."),
    click.option(
        "--robot",
        default="lab",
        show_default=True,
        shell_complete=completion.plugins("robot"),
        help="lab, sim_ur5e, or a real arm.",
    ),
    click.option("--station", default="ur5e", show_default=True, help="The lab's arm: ur5e or vs060."),
    click.option("--urdf", help="URDF of the vs060."),
    click.option("--host", help="Address of the controller."),
    click.option("--arm", is_flag=True, help="Let a robot that is not simulated move, after a question."),
    click.option("--calibration", type=click.IntRange(min=0), help="Which of the lab's calibrations it is."),
    click.option("--camera", shell_complete=completion.plugins("camera"), help="Camera of a real cell."),
    click.option("--gripper", shell_complete=completion.plugins("gripper"), help="Gripper of a real cell."),
    click.option("--set", "settings", multiple=True, metavar="DEVICE.NAME=VALUE", help="E.g. robot.time_scale=300."),
    click.option("--places", type=click.IntRange(min=1), default=3, show_default=True, help="Of a real cell."),
    click.option("--trials", type=click.IntRange(min=1), help="At most so many for each method."),
    click.option("--clearance-mm", type=click.FloatRange(0.1, 10), default=2.0, show_default=True),
    click.option("--size", default="2448x2048", show_default=True, help="Of the lab's pictures, px."),
    click.option("--supersample", type=click.IntRange(1, 8), default=2, show_default=True),
    click.option("--noise", type=click.FloatRange(min=0), default=0.0, show_default=True, help="Grey levels of 255."),
    click.option("--render/--no-render", default=True, help="Without pictures the tag's pose is exact."),
    click.option("--dynamics", is_flag=True, help="Judge grasps by lifting the block, with dynamics."),
    click.option("--out", type=_folder, default=Path("out/trials"), show_default=True),
    click.option("--resume", is_flag=True, help="Go on with what --out holds."),
    click.option("--yes", is_flag=True, help="Answer the question before the first motion with yes."),
    click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True),
    click.option("--json", "as_json", is_flag=True, help="Print JSON and nothing else."),
]  # fmt: skip


def _with_options(command: Callable[..., None]) -> Callable[..., None]:
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


@click.group()
def trial() -> None:
    """Try calibrations on a workpiece: how often does the gripper succeed?"""


@trial.command()
@_with_options
def grasp(**options: Any) -> None:
    """Grasp a block where the calibration says that it is."""
    _trial("grasp", options)


@trial.command()
@_with_options
def insertion(**options: Any) -> None:
    """Put a peg into a hole where the calibration says that it is."""
    _trial("insertion", options)


def _trial(task_name: str, given: dict[str, Any]) -> None:
    from hecbench import __version__
    from hecbench.running.solving import versions
    from hecbench_hardware.lab.trial_cell import LabCell
    from hecbench_hardware.trials import runner
    from hecbench_hardware.trials.opening import open_cell
    from hecbench_hardware.trials.options import TrialOptions
    from hecbench_hardware.trials.tasks import Task

    options = TrialOptions(**given)
    if options.dynamics and task_name != "grasp":
        raise InputError("--dynamics is for grasps: insertions are judged by contact alone")
    origin = {
        "hecbench": __version__,
        "versions": versions(),
        "command": shlex.join(["hecbench", *sys.argv[1:]]),
    }
    with ExitStack() as open_devices:
        opened = open_cell(options, open_devices)
        for note in opened.notes:
            click.echo(note, err=True)
        plan = runner.Plan(
            Task(task_name),
            [found for found in opened.calibrations if found.method in (options.solvers or {found.method})],
            clearance_m=options.clearance_mm / 1e3,
            most=options.trials,
            seed=options.seed,
            provenance=origin | options.provenance,
        )
        contents = runner.run(
            plan,
            opened.cell,
            options.out,
            resume=options.resume,
            acknowledge=opened.operator.acknowledge,
            report=_report,
            warn=lambda line: click.echo(line, err=True),
        )
        if options.render and isinstance(opened.cell, LabCell):
            _draw(plan, opened.cell, options.out)
    _print(contents, options.out, options.as_json)


def _draw(plan: Plan, cell: LabCell, out: Path) -> None:
    """The first trial of a task as pictures, which the report shows."""
    from hecbench.storage.trial_record import picture_name
    from hecbench_hardware.lab import pictures

    if cell.camera is not None and not (out / picture_name(cell.name, plan.task, "png")).exists():
        eye = cell.camera.eye
        pictures.write(out, plan.task, plan.calibrations[0], cell.station, eye.camera, eye.sensor)


def _report(record: TrialRecord) -> None:
    margin = "" if record.margin_mm is None else f", margin {record.margin_mm:.1f} mm"
    what = f"{record.method} {record.calibration} place {record.place}"
    click.echo(f"{record.task} {what}: {record.outcome}{margin} {record.reason}".rstrip(), err=True)


def _print(contents: Contents, out: Path, as_json: bool) -> None:
    """The table; exits with 1 when a planned trial ended without a verdict."""
    import msgspec

    from hecbench.commands import console
    from hecbench.report import trials as report

    if as_json:
        click.echo(msgspec.json.format(msgspec.json.encode(contents.trials), indent=1))
    else:
        for table in report.tables(contents.trials):
            console.print_table(table)
    click.echo(f"trials: {out}", err=True)
    decided = {trial.key for trial in contents.trials}
    if any(trial.key not in decided for trial in contents.aborted):
        sys.exit(1)
