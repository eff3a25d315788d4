"""The verb of this package: ``hecbench detect``."""

from __future__ import annotations

from pathlib import Path

import click

from hecbench.commands import choices
from hecbench.errors import InputError


@click.command()
@click.argument("recording", type=click.Path(path_type=Path))
@click.argument("destination", type=click.Path(path_type=Path, file_okay=False), metavar="DEST")
@click.option("--refit-intrinsics", is_flag=True, help="Calibrate the camera although K is given.")
@choices.no_cache
def detect(recording: Path, destination: Path, refit_intrinsics: bool) -> None:
    """Find the target in a RECORDING's images; write the recording with its corners and pictures of them to DEST."""
    from hecbench import preparation
    from hecbench.storage import recording_io
    from hecbench_plugins import detection

    if recording_io.is_recording(destination):
        raise InputError(f"{destination}: holds a recording already; give another destination")
    found = detection.detect(preparation.load_recording(recording), refit_intrinsics=refit_intrinsics)
    pictures = detection.write_overlays(found, destination / "detections")
    recording_io.save(found, destination)
    for note in found.notes:
        click.echo(note, err=True)
    click.echo(f"{destination}: corners of {len(found)} samples, {len(pictures)} pictures in detections/")
