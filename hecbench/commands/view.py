"""The verb `view`."""

from __future__ import annotations

import time
from pathlib import Path

import click

from hecbench.commands import choices
from hecbench.errors import InputError


@click.command()
@click.argument("recording", type=choices.ANY_PATH)
@click.option(
    "--estimate",
    "answers",
    type=choices.ANY_PATH,
    multiple=True,
    required=True,
    help="A file, or a folder of results; repeatable. The first is drawn bold.",
)
@click.option("--save", type=choices.FILE, help="Write the scene to FILE.html or FILE.viser and end.")
@click.option("--host", default="127.0.0.1", show_default=True)
@click.option("--port", type=click.IntRange(0, 65535), default=8080, show_default=True)
def view(recording: Path, answers: tuple[Path, ...], save: Path | None, host: str, port: int) -> None:
    """Show a RECORDING in 3D in the browser: robot, target, and the camera where each estimate places it."""
    from hecbench import preparation
    from hecbench.report import recommended, viewer

    if save is not None and save.suffix not in (".html", ".viser"):
        raise InputError(f"--save {save}: give a name that ends in .html or .viser")
    loaded = preparation.prepare(preparation.load_recording(recording))
    if loaded.base_T_flange is None:
        raise InputError(f"{recording}: has no robot poses, and no robot model that would give them")
    estimates = recommended.all_of(answers, loaded)
    stage = viewer.Stage(viewer.open_server(host, port), loaded, estimates)
    if save is not None:
        stage.save(save)
        stage.close()
        click.echo(f"{save}: {len(estimates)} cameras")
        return
    click.echo(f"http://{host}:{stage.server.get_port()} (end with Ctrl-C)")
    while True:
        time.sleep(1)
