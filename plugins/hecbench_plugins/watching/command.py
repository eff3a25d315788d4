"""The verb ``hecbench watch``."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import msgspec

from hecbench.commands import choices, completion
from hecbench.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from hecbench.recording import Recording
    from hecbench.se3 import Array

Frames = Iterator[tuple["NDArray[np.uint8]", "Array"]]


@click.command()
@click.argument("recording", type=choices.ANY_PATH)
@click.option("--estimate", "answer", type=choices.ANY_PATH, required=True, help="The calibration to watch.")
@click.option(
    "--track", is_flag=True, help="Go on after an alarm with the pose found; without it an alarm ends."
)
@click.option("--out", type=choices.FILE, help="Write the tracked estimate to FILE, after every alarm.")
@click.option(
    "--limit-mm", type=click.FloatRange(min=0, min_open=True), help="Displacement that is an alarm."
)
@click.option(
    "--camera",
    shell_complete=completion.plugins("camera"),
    help="A device that gives the frames, instead of the recording's pictures.",
)
@click.option("--robot", shell_complete=completion.plugins("robot"), help="The device that gives the joints.")
@click.option("--host", help="Address of the controller.")
@click.option("--set", "settings", multiple=True, metavar="DEVICE.NAME=VALUE", help="E.g. camera.index=1.")
@click.option(
    "--rate", type=click.FloatRange(0.1, 100), default=10.0, show_default=True, help="Frames per second."
)
@click.option(
    "--frames", type=click.IntRange(min=1), help="End after so many; default: the recording's, or never."
)
@choices.as_json
@choices.threads
def watch(
    recording: Path,
    answer: Path,
    track: bool,
    out: Path | None,
    limit_mm: float | None,
    camera: str | None,
    robot: str | None,
    host: str | None,
    settings: tuple[str, ...],
    rate: float,
    frames: int | None,
    as_json: bool,
) -> None:
    """Is the calibration still true? Follow the robot's contour in the frames of RECORDING, or of a live cell.

    RECORDING names robot, camera and mounting; its pictures are the frames, in their order, unless --camera and
    --robot give live ones. Exits with 3 at an alarm, with 1 when the robot was never seen.
    """
    from hecbench import estimate as estimates
    from hecbench import preparation
    from hecbench_plugins.watching.settings import WatchSettings
    from hecbench_plugins.watching.state import Verdict
    from hecbench_plugins.watching.watch import Watch

    if (camera is None) != (robot is None):
        raise InputError("live frames need both --camera and --robot")
    if out is not None and not track:
        raise InputError(f"--out {out}: only --track finds another estimate; add it")
    cell = preparation.load_recording(recording)
    chosen = WatchSettings() if limit_mm is None else WatchSettings(limit_mm=limit_mm)
    watched = Watch(cell, estimates.load(answer), chosen, track)
    alarms, seen = 0, False
    with ExitStack() as opened:
        shown = _live(opened, camera, robot, host, settings, rate) if camera and robot else _recorded(cell)
        for number, (image, joints) in enumerate(shown):
            state = watched.update(image, joints)
            seen |= state.verdict in (Verdict.TRUE, Verdict.MOVED)
            _say(state.to_json(), as_json)
            if state.verdict is Verdict.MOVED:
                alarms += 1
                if out is not None:
                    watched.estimate.save(out)
                if not track:
                    break
            if frames is not None and number + 1 >= frames:
                break
    if alarms:
        sys.exit(3)
    if not seen:
        raise click.exceptions.Exit(1)


def _recorded(cell: Recording) -> Frames:
    """The pictures of a recording with their joints; one that cannot be read is named and left out."""
    import numpy as np

    joints = cell.joints_rad
    rows = [i for i, source in enumerate(cell.images or ()) if source is not None]
    if joints is None or not rows:
        raise InputError(f"{cell.name}: needs pictures with joints_rad: watching follows the robot in them")
    for row in rows:
        try:
            image = cell.image(row)
        except InputError as error:
            click.echo(str(error), err=True)
            continue
        if np.isfinite(joints[row]).all():
            yield image, joints[row]


def _live(
    opened: ExitStack, camera: str, robot: str, host: str | None, settings: tuple[str, ...], rate: float
) -> Frames:
    """Frames of a camera with the robot's joints of the same moment."""
    from hecbench.commands.devices import device_settings, open_robot_and_camera

    given = device_settings(settings)
    if host:
        given["robot"]["host"] = host
    arm, eye = open_robot_and_camera(opened, robot, camera, given)
    while True:
        began = time.monotonic()
        before = arm.state().joints_rad
        frame = eye.grab()
        yield frame.image, (before + arm.state().joints_rad) / 2
        time.sleep(max(0.0, 1 / rate - (time.monotonic() - began)))


def _say(state: dict[str, Any], as_json: bool) -> None:
    if as_json:
        click.echo(msgspec.json.encode(state).decode())
        return
    numbers = "" if state["score"] is None else f"score {state['score']:.2f}"
    if state["offset_mm"] is not None:
        numbers += f" offset {state['offset_mm']:.1f} mm"
    confirmed = f"{100 * state['confirmed']:.0f} % of the contour"
    click.echo(
        "  ".join(
            filter(None, [f"{state['frame']:6d}", state["verdict"], confirmed, numbers, state["reason"]])
        )
    )
