"""The verb ``hecbench cockpit``."""

from __future__ import annotations

import time
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hecbench.commands import choices, completion
from hecbench.commands.devices import device_settings, open_robot_and_camera
from hecbench.errors import InputError

if TYPE_CHECKING:
    from hecbench.recording import Recording
    from hecbench.verdict import Verdict
    from hecbench_hardware.cockpit.choosing import Devices
    from hecbench_hardware.cockpit.page import Page
    from hecbench_hardware.cockpit.session import Session
    from hecbench_hardware.devices import Camera, Robot

_SIMULATED = "lab"
_HOST = "127.0.0.1"
_LAB_PICTURE = {"width": "1224", "height": "1024", "noise": "2"}
_CALIBRATION = "calibration"
_TICK_S, _REST_S = 0.2, 0.05
"""Between two looks, and the least of it that is left to the page."""


@click.command()
@click.argument("cell", type=choices.ANY_PATH, required=False)
@click.option(
    "--out", type=choices.FOLDER, help="Of the recording; an unfinished one goes on. Default: out/cockpit."
)
@click.option(
    "--robot",
    shell_complete=completion.plugins("robot"),
    help="A robot of `hecbench plugins`, or `typed`. Default: chosen on the page.",
)
@click.option(
    "--camera",
    shell_complete=completion.plugins("camera"),
    help="A camera of `hecbench plugins`. Default: chosen on the page.",
)
@click.option("--host", help="Address of the robot's controller.")
@click.option("--arm", is_flag=True, help="Let a robot that is not simulated move, after a question here.")
@click.option("--freedrive", is_flag=True, help="Guide the arm by hand all the time; it is not driven then.")
@click.option("--limits", type=choices.FILE, help="JSON file of limits; see docs/hardware-safety.md.")
@click.option("--set", "settings", multiple=True, metavar="DEVICE.NAME=VALUE", help="E.g. camera.index=1.")
@click.option(
    "--frames", type=click.IntRange(min=1), default=1, show_default=True, help="Averaged per sample."
)
@choices.tolerance
@click.option("--port", type=click.IntRange(0, 65535), default=8080, show_default=True)
@choices.threads
def cockpit(
    cell: Path | None,
    out: Path | None,
    robot: str | None,
    camera: str | None,
    host: str | None,
    arm: bool,
    freedrive: bool,
    limits: Path | None,
    settings: tuple[str, ...],
    frames: int,
    tolerance_mm: float,
    port: int,
) -> None:
    """Record and calibrate a cell in the browser: what to do next, and how good it is so far.

    CELL is a recording folder that describes camera, target and mounting; without it the simulated cell of the lab is
    used. The recording is left in --out, the calibration in --out/calibration.
    """
    from hecbench import preparation
    from hecbench.report import viewer
    from hecbench_hardware.cockpit.choosing import Devices, ask
    from hecbench_hardware.cockpit.page import Page
    from hecbench_hardware.cockpit.session import Session

    if arm and robot is None:
        raise InputError(
            "--arm: name the arm that may move with --robot; none that is chosen on the page may"
        )
    if cell is None and {robot, camera} - {None, _SIMULATED}:
        raise InputError(
            "give a CELL that describes camera, target and mounting; docs/cockpit.md makes a first one"
        )
    described = None if cell is None else preparation.load_recording(cell).without_truth()
    given = device_settings(settings)
    if limits is not None:
        given["robot"]["limits"] = str(limits)
    with ExitStack() as opened:
        server = viewer.open_server(_HOST, port)
        opened.callback(viewer.close_server, server)
        click.echo(f"http://{_HOST}:{server.get_port()} (end with Ctrl-C)")

        def use(chosen: Devices) -> Session:
            with ExitStack() as trying:
                device, eye = _open(trying, chosen, given)
                _take_control(trying, device, arm, freedrive)
                known = described or _lab_cell(given["camera"], eye)
                driven = device.enabled and not freedrive
                session = Session(known, device, eye, out or Path("out/cockpit"), frames, driven)
                opened.enter_context(trying.pop_all())
                return session

        suggested = Devices(robot or _SIMULATED, camera or _SIMULATED, host)
        if robot is None and camera is None:
            session = ask(server, suggested, simulated_only=cell is None, use=use)
        else:
            session = use(suggested)
        page = Page(server, session, tolerance_mm, partial(finish, tolerance_mm))
        opened.callback(page.close)
        _keep_up(page)


def _keep_up(page: Page) -> None:
    """Look again and again, until it is interrupted."""
    while True:
        began = time.monotonic()
        page.tick()
        time.sleep(max(_REST_S, _TICK_S - (time.monotonic() - began)))


def _open(opened: ExitStack, chosen: Devices, given: dict[str, dict[str, str]]) -> tuple[Robot, Camera]:
    """The devices; those of the lab with a table and a picture of moderate size."""
    host = {"host": chosen.host} if chosen.host else {}
    table = {"floor": "0"} if chosen.robot == _SIMULATED else {}
    drawn = _LAB_PICTURE if chosen.camera == _SIMULATED else {}
    options = {"robot": table | given["robot"] | host, "camera": drawn | given["camera"]}
    return open_robot_and_camera(opened, chosen.robot, chosen.camera, options)


def _take_control(opened: ExitStack, robot: Robot, armed: bool, freedrive: bool) -> None:
    """Enable a simulated arm, or a real one that is armed; the others are only read."""
    from hecbench_hardware.arming import Operator, take_control
    from hecbench_hardware.robots.typed import TypedRobot

    if isinstance(robot, TypedRobot) or not (robot.simulated or armed or freedrive):
        return
    what = "guided by hand" if freedrive else "to poses that are shown on the page"
    take_control(robot, what, armed=armed, confirm=Operator(robot).confirm)
    if freedrive:
        opened.enter_context(robot.freedrive())


def _lab_cell(options: dict[str, str], eye: Camera) -> Recording:
    """The lab's arm with its tag, as a person would describe it."""
    from hecbench_hardware.lab import cells, recordings
    from hecbench_hardware.options import number

    station = cells.station(options.get("arm", "ur5e"), options.get("urdf"))
    camera = eye.intrinsics()
    assert camera is not None
    return recordings.cell(station, int(number(options, "calibration", 0)), camera)


def finish(tolerance_mm: float, session: Session) -> Verdict:
    """Calibrate what was recorded by every method that can."""
    from hecbench.commands.calibrate import calibrate_into
    from hecbench.running import planning

    recording = session.recording()
    specs = planning.solvers_for((), recording)
    folder = session.folder / _CALIBRATION
    found, page = calibrate_into(folder, recording, specs, choices.run_options(0), tolerance_mm)
    click.echo(f"report: {page}", err=True)
    return found
