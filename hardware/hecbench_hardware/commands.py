"""The verbs of devices: ``hecbench controller`` and ``hecbench record``."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hecbench.commands import completion
from hecbench.commands.devices import device_settings, open_device
from hecbench.errors import InputError

if TYPE_CHECKING:
    from hecbench.recording import Recording
    from hecbench_hardware.devices import Robot

_folder = click.Path(path_type=Path, file_okay=False)
_file = click.Path(path_type=Path, dir_okay=False)


@click.command()
@click.option("--host", default="127.0.0.2", show_default=True, help="A loopback address; one per arm.")
@click.option("--model", default="ur5e", show_default=True, help="ur3e, ur5e or ur10e.")
@click.option("--time-scale", type=float, default=1.0, show_default=True, help="Its seconds per real second.")
@click.option("--software", default="5.11.6.0", show_default=True, help="The version that it claims to be.")
def controller(host: str, model: str, time_scale: float, software: str) -> None:
    """Run a simulated UR controller until it is interrupted; prints `ready HOST` when it listens."""
    from hecbench_hardware.controller_sim.server import serve, version_of

    version = version_of(software)
    serve(host, model=model, time_scale=time_scale, version=version, announce=click.echo)


@click.command()
@click.argument("cell", type=click.Path(path_type=Path))
@click.option(
    "--out", type=_folder, required=True, help="Folder of the recording; an unfinished one goes on."
)
@click.option("--robot", default="sim_ur5e", show_default=True, shell_complete=completion.plugins("robot"))
@click.option("--host", help="Address of the controller.")
@click.option("--arm", is_flag=True, help="Let a robot that is not simulated move, after a question.")
@click.option("--limits", type=_file, help="JSON file of limits; see docs/hardware-safety.md.")
@click.option(
    "--camera",
    default="none",
    show_default=True,
    shell_complete=completion.plugins("camera"),
    help="none records poses only.",
)
@click.option(
    "--set", "settings", multiple=True, metavar="DEVICE.NAME=VALUE", help="E.g. camera.folder=images."
)
@click.option("--poses", type=click.IntRange(min=3), help="Plan this many poses around the first sample.")
@click.option(
    "--plan",
    "criterion",
    type=click.Choice(["diverse", "d_optimal", "mask_variance"]),
    help="How --poses chooses: diverse poses of the target, or views in which the robot shows most about the camera. "
    "Default: diverse, or d_optimal for a cell without a target.",
)
@click.option(
    "--init",
    metavar="WHERE",
    help="Where the camera is, roughly, in place of the CELL's: as for `solve --init`, e.g. 'looking-at 1.2 0.3 0.7'.",
)
@click.option("--freedrive", is_flag=True, help="Guide the arm by hand instead of driving a plan.")
@click.option(
    "--frames", type=click.IntRange(min=1), default=1, show_default=True, help="Averaged per sample."
)
@click.option("--dry-run", is_flag=True, help="Check the plan and drive it on a simulated controller only.")
@click.option("--yes", is_flag=True, help="Answer the question before the first motion with yes.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@click.option("--json", "as_json", is_flag=True, help="Print JSON and nothing else.")
def record(
    cell: Path,
    out: Path,
    robot: str,
    host: str | None,
    arm: bool,
    limits: Path | None,
    camera: str,
    settings: tuple[str, ...],
    poses: int | None,
    criterion: str | None,
    init: str | None,
    freedrive: bool,
    frames: int,
    dry_run: bool,
    yes: bool,
    seed: int,
    as_json: bool,
) -> None:
    """Record the poses of CELL, a recording folder whose samples have joints, with a robot and a camera.

    CELL describes camera, target and mounting. Its samples are the plan, or with --poses the first one is the
    start of a planned one, or with --freedrive they are not used. The checked plan is written to OUT/plan.json.
    """
    from hecbench.specs import Kind
    from hecbench_hardware.arming import Operator, take_control
    from hecbench_hardware.devices import FollowsRobot, KnowsTruth
    from hecbench_hardware.recorder.record import Recorder

    if freedrive and (poses is not None or dry_run):
        raise InputError("--freedrive has no plan: leave --poses and --dry-run out")
    if criterion is not None and poses is None:
        raise InputError(f"--plan {criterion}: say how many with --poses")
    plan = _described(cell, init)
    given = device_settings(settings)
    extra = {key: str(value) for key, value in (("host", host), ("limits", limits)) if value is not None}
    with ExitStack() as open_devices:
        eye = None
        if camera != "none" and not dry_run:
            eye = open_device(Kind.CAMERA, camera, given["camera"])
            open_devices.callback(eye.close)
        device = open_device(Kind.ROBOT, robot, given["robot"] | extra)
        open_devices.callback(device.close)
        if isinstance(eye, FollowsRobot):
            eye.follow(device)
        what = "guided by hand"
        if not freedrive:
            plan, what = _checked(plan, device, out, poses, criterion, seed, dry_run)
            click.echo(f"{out}/plan.json: {what}", err=True)
            if dry_run:
                return
        operator = Operator(device, yes)
        take_control(device, what, armed=arm, confirm=operator.confirm)
        recorder = Recorder(
            device, eye, plan, out, frames=frames, acknowledge=operator.acknowledge, report=_say
        )
        recording = recorder.follow_hand(_more) if freedrive else recorder.drive()
        if isinstance(eye, KnowsTruth):
            recording = eye.with_truth(recording)
    _print(recording, out, as_json)


def _say(line: str) -> None:
    click.echo(line, err=True)


def _described(cell: Path, init: str | None) -> Recording:
    """The recording that describes the cell, with the camera's rough place where it is given."""
    from hecbench.running.starts import start_of
    from hecbench.storage import recording_io

    described = recording_io.load(cell)
    if init is None:
        return described
    return replace(described, initial_parent_T_camera=start_of(init, described))


def _checked(
    cell: Recording,
    robot: Robot,
    out: Path,
    poses: int | None,
    criterion: str | None,
    seed: int,
    dry_run: bool,
) -> tuple[Recording, str]:
    """The plan, checked from where the arm stands, and what it amounts to in words."""
    import numpy as np

    from hecbench_hardware.recorder import plan as planning
    from hecbench_hardware.recorder.poses import Criterion, diverse_plan, informative_plan
    from hecbench_hardware.recorder.session import PLAN_NAME

    if cell.robot and cell.robot.model not in (None, robot.arm.name):
        raise InputError(
            f"{cell.name} was made for a {cell.robot.model}, not a {robot.arm.name}: choose --robot"
        )
    if poses is not None:
        chosen_by = criterion or ("diverse" if cell.target else Criterion.D_OPTIMAL)
        arguments = cell, robot.arm, robot.limits, poses, np.random.default_rng(seed)
        if chosen_by == "diverse":
            cell = diverse_plan(*arguments)
        else:
            cell = informative_plan(*arguments, criterion=Criterion(chosen_by))
    check = planning.dry_run if dry_run else planning.check_plan
    steps = check(robot.arm, cell, robot.state().joints_rad, robot.limits)
    planning.write_plan(steps, out / PLAN_NAME)
    return cell, f"{len(steps)} motions, about {sum(step.expected_s for step in steps):.0f} s"


def _more(count: int) -> bool:
    answer = click.prompt(f"{count} samples; Enter records, q ends", default="", show_default=False, err=True)
    return str(answer).strip().lower() != "q"


def _print(recording: Recording, out: Path, as_json: bool) -> None:
    """What was recorded and what `check` says; exits with 3 on a critical finding."""
    import msgspec

    from hecbench.diagnose import Severity, check

    if not as_json:
        click.echo(f"{out}: {len(recording)} samples")
    findings = check(recording)
    if as_json:
        answer = {
            "recording": str(out),
            "samples": len(recording),
            "findings": [finding.to_json() for finding in findings],
        }
        click.echo(msgspec.json.format(msgspec.json.encode(answer), indent=1))
    else:
        for finding in findings:
            if finding.severity is not Severity.OK:
                click.echo(f"{finding.severity}: {finding.summary}; {finding.action}".rstrip("; "))
    if any(finding.severity is Severity.CRITICAL for finding in findings):
        sys.exit(3)
