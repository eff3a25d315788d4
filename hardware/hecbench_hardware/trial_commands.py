"""The verb ``hecbench trial``: grasps and insertions with calibrations, in the lab or on a real arm."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hecbench.errors import InputError

if TYPE_CHECKING:
    from hecbench.storage.trial_record import Contents, TrialRecord
    from hecbench_hardware.lab.trial_cell import LabCell
    from hecbench_hardware.trials.cell import Calibration, TrialCell
    from hecbench_hardware.trials.runner import Plan

_folder = click.Path(path_type=Path, file_okay=False)
_path = click.Path(path_type=Path)

_OPTIONS = [
    click.option("--estimate", "estimates", type=_path, multiple=True, help="Estimate file or folder of a run."),
    click.option("--solver", "solvers", multiple=True, metavar="NAME", help="Only these of a folder."),
    click.option("--offset-mm", type=click.FloatRange(min=0), help="Instead: the true calibrations, moved."),
    click.option("--robot", default="lab", show_default=True, help="lab, sim_ur5e, or a real arm."),
    click.option("--station", default="ur5e", show_default=True, help="The lab's arm: ur5e or vs060."),
    click.option("--urdf", help="URDF of the vs060."),
    click.option("--host", help="Address of the controller."),
    click.option("--arm", is_flag=True, help="Let a robot that is not simulated move, after a question."),
    click.option("--calibration", type=click.IntRange(min=0), help="Which of the lab's calibrations it is."),
    click.option("--camera", help="Camera of a real cell."),
    click.option("--gripper", help="Gripper of a real cell."),
    click.option("--set", "settings", multiple=True, metavar="DEVICE.NAME=VALUE", help="E.g. robot.time_scale=300."),
    click.option("--places", type=click.IntRange(min=1), default=3, show_default=True, help="Of a real cell."),
    click.option("--trials", type=click.IntRange(min=1), help="At most so many for each method."),
    click.option("--clearance-mm", type=click.FloatRange(0.1, 10), default=2.0, show_default=True),
    click.option("--size", default="2448x2048", show_default=True, help="Of the lab's pictures, px."),
    click.option("--supersample", type=click.IntRange(1, 8), default=2, show_default=True),
    click.option("--noise", type=click.FloatRange(min=0), default=0.0, show_default=True, help="Grey levels of 255."),
    click.option("--render/--no-render", default=True, help="Without pictures the tag's pose is exact."),
    click.option("--dynamics", is_flag=True, help="Judge grasps by lifting the block, with dynamics."),
    click.option("--out", type=_folder, help="Default: out/trials."),
    click.option("--resume", is_flag=True, help="Go on with what --out holds."),
    click.option("--yes", is_flag=True, help="Answer every question with yes."),
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


def _trial(task_name: str, options: dict[str, Any]) -> None:
    from hecbench_hardware.lab.trial_cell import LabCell
    from hecbench_hardware.trials import runner
    from hecbench_hardware.trials.tasks import Task

    if options["dynamics"] and task_name != "grasp":
        raise InputError("--dynamics is for grasps: insertions are judged by contact alone")
    if (options["offset_mm"] is None) == (not options["estimates"]):
        raise InputError("give either --estimate FILE or --offset-mm D")
    out = options["out"] or Path("out/trials")
    with ExitStack() as open_devices:
        cell, calibrations, notes = _cell(options, open_devices)
        for note in notes:
            click.echo(note, err=True)
        if options["solvers"]:
            calibrations = [found for found in calibrations if found.method in options["solvers"]]
        plan = runner.Plan(
            Task(task_name),
            calibrations,
            clearance_m=options["clearance_mm"] / 1e3,
            most=options["trials"],
            seed=options["seed"],
            provenance=_provenance(options),
        )
        contents = runner.run(
            plan,
            cell,
            out,
            resume=options["resume"],
            acknowledge=lambda line: _acknowledged(line, options["yes"] or cell.robot.simulated),
            report=_report,
            warn=lambda line: click.echo(line, err=True),
        )
        if options["render"] and isinstance(cell, LabCell):
            _draw(plan, cell, out)
    _print(contents, out, options["as_json"])


def _cell(options: dict[str, Any], opened: ExitStack) -> tuple[TrialCell, list[Calibration], list[str]]:
    """The lab with its own arm or one on a simulated controller, or a real table."""
    from hecbench import registry
    from hecbench.specs import DeviceSpec, Kind

    spec = registry.load().get(Kind.ROBOT, options["robot"], DeviceSpec)
    if not spec.simulated:
        return _real_cell(options, opened)
    return _lab_cell(options, opened)


def _lab_cell(options: dict[str, Any], opened: ExitStack) -> tuple[TrialCell, list[Calibration], list[str]]:
    from hecbench_hardware.arming import take_control
    from hecbench_hardware.lab import cells
    from hecbench_hardware.lab.eye import Sensor
    from hecbench_hardware.lab.trial_cell import LabCell, lab_camera
    from hecbench_hardware.trials import calibrations

    station = cells.station(options["station"], options["urdf"])
    model = cells.camera_model(*_size(options["size"]))
    if options["offset_mm"] is not None:
        count, offset = station.calibrations, options["offset_mm"]
        found = calibrations.moved_truth(count, station.camera_pose, offset, options["seed"])
        notes: list[str] = []
    else:
        found, notes = calibrations.from_estimates(
            options["estimates"],
            parent_link=station.base_link,
            camera=model,
            number=options["calibration"],
            truth=station.camera_pose,
        )
    robot = _lab_robot(options, station)
    opened.callback(robot.close)
    camera = None
    if options["render"]:
        sensor = Sensor(options["supersample"], options["noise"])
        camera = lab_camera(station, model, sensor, options["seed"])
        opened.callback(camera.close)
    take_control(robot, "trials", armed=options["arm"], confirm=lambda line: True)
    return LabCell(station, robot, camera, options["seed"], options["dynamics"]), found, notes


def _lab_robot(options: dict[str, Any], station: Any) -> Any:
    """The lab's own arm, or the UR driver on a simulated controller with the lab's limits."""
    from hecbench.specs import Kind
    from hecbench_hardware.commands import device_settings, open_device
    from hecbench_hardware.lab.arm import LabRobot

    if options["robot"] == "lab":
        return LabRobot(station)
    given = device_settings(options["settings"])["robot"]
    host = {} if options["host"] is None else {"host": options["host"]}
    robot = open_device(Kind.ROBOT, options["robot"], {"max_age_s": "2", **given, **host})
    if robot.arm.name != station.name:
        robot.close()
        raise InputError(
            f"--robot {options['robot']} is not the lab's {station.name}: choose sim_{station.name}"
        )
    robot.limits = station.limits
    return robot


def _real_cell(options: dict[str, Any], opened: ExitStack) -> tuple[TrialCell, list[Calibration], list[str]]:
    from hecbench import registry
    from hecbench.specs import DeviceSpec, Kind
    from hecbench_hardware.arming import take_control
    from hecbench_hardware.commands import device_settings, open_device
    from hecbench_hardware.trials import calibrations, solids
    from hecbench_hardware.trials.real_cell import RealCell

    missing = [f"--{name}" for name in ("camera", "gripper") if options[name] is None]
    if missing or not options["estimates"]:
        raise InputError(f"a real cell needs {' and '.join([*missing, '--estimate'])}")
    found, notes = calibrations.from_estimates(
        options["estimates"], parent_link="base", camera=None, number=0, truth=None
    )
    model = next((item.estimate.camera for item in found if item.estimate), None)
    if model is None:
        raise InputError(f"{options['estimates'][0]}: has no answer with a camera: calibrate again")
    settings = device_settings(options["settings"])
    camera = open_device(Kind.CAMERA, options["camera"], settings["camera"])
    opened.callback(camera.close)
    host = {} if options["host"] is None else {"host": options["host"]}
    takes_host = "host" in registry.load().get(Kind.GRIPPER, options["gripper"], DeviceSpec).options
    gripper = open_device(
        Kind.GRIPPER, options["gripper"], (host if takes_host else {}) | settings["gripper"]
    )
    opened.callback(gripper.close)
    robot = open_device(Kind.ROBOT, options["robot"], settings["robot"] | host)
    opened.callback(robot.close)

    def ask(line: str) -> bool:
        return bool(options["yes"]) or click.confirm(line, err=True)

    take_control(
        robot, "trials from where it stands, which becomes its home", armed=options["arm"], confirm=ask
    )
    shape = solids.GRIPPERS["robotiq_2f_85" if "robotiq" in options["gripper"] else "rg2"]
    cell = RealCell(robot, gripper, camera, model, shape, places=options["places"], ask=ask)
    return cell, found, notes


def _size(text: str) -> tuple[int, int]:
    width, cross, height = text.partition("x")
    if not (cross and width.isdigit() and height.isdigit() and int(width) >= 64 and int(height) >= 64):
        raise InputError(f"--size {text}: write WIDTHxHEIGHT in px, at least 64x64")
    return int(width), int(height)


def _provenance(options: dict[str, Any]) -> dict[str, Any]:
    from hecbench import __version__

    shown = ("robot", "station", "size", "supersample", "noise", "render", "dynamics")
    return {"hecbench": __version__, "command": shlex.join(["hecbench", *sys.argv[1:]])} | {
        name: options[name] for name in shown
    }


def _draw(plan: Plan, cell: LabCell, out: Path) -> None:
    """The first trial of a task as pictures, which the report shows."""
    from hecbench.storage.trial_record import picture_name
    from hecbench_hardware.lab import pictures

    if cell.camera is not None and not (out / picture_name(cell.name, plan.task, "png")).exists():
        eye = cell.camera.eye
        pictures.write(out, plan.task, plan.calibrations[0], cell.station, eye.camera, eye.sensor)


def _acknowledged(line: str, at_once: bool) -> bool:
    click.echo(line, err=True)
    return at_once or (sys.stdin.isatty() and click.confirm("Make the arm ready and go on?", err=True))


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
