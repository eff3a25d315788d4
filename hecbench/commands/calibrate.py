"""The verb `calibrate`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hecbench.commands import choices, console
from hecbench.errors import HecbenchError, InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from hecbench.recording import Recording
    from hecbench.running.solving import Options
    from hecbench.specs import SolverSpec
    from hecbench.verdict import Verdict

EXIT_CODES = {"good": 0, "usable": 0, "doubtful": 1, "do_not_use": 3}


@click.command()
@click.argument("recording", type=choices.ANY_PATH)
@choices.solvers
@choices.segmenter
@choices.tolerance
@click.option(
    "--at", metavar="X,Y,Z", help="A place, metres in the parent's frame, where the error is wanted too."
)
@click.option(
    "--held-out/--no-held-out",
    default=None,
    help="Predict left-out samples also by slow methods, or by none; default: by fast methods.",
)
@choices.timeout
@click.option("--out", type=choices.FOLDER, help="Default: out/<recording's name>.")
@choices.threads
@choices.no_cache
@choices.seed
@choices.as_json
def calibrate(
    recording: Path,
    solvers: tuple[str, ...],
    segmenter: str | None,
    tolerance_mm: float,
    at: str | None,
    held_out: bool | None,
    timeout_s: float | None,
    out: Path | None,
    seed: int,
    as_json: bool,
) -> None:
    """Check a RECORDING, calibrate it by every method that can, and say which answer to use and how good it is.

    Writes verdict.json, report.html, <solver>.json and exports/ into --out. Exits with 0 when the answer is good or
    usable, 1 when it is doubtful, 3 when it is not to be used.
    """
    from hecbench import preparation
    from hecbench.running import planning

    at_m = _place(at)
    loaded = preparation.load_recording(recording).without_truth()
    specs = planning.solvers_for(solvers, loaded, segmenter)
    if not specs:
        raise HecbenchError(
            f"{recording}: no ready solver can use what it offers: {', '.join(sorted(loaded.offers()))}"
        )
    out = out or Path("out") / loaded.name
    options = choices.run_options(seed, held_out, segmenter, timeout_s)
    found, page = calibrate_into(out, loaded, specs, options, tolerance_mm, at_m)
    if as_json:
        console.print_json(found.to_json())
    else:
        console.print_verdict(found)
    click.echo(f"report: {page}", err=True)
    sys.exit(EXIT_CODES[found.grade])


def calibrate_into(
    out: Path,
    recording: Recording,
    specs: Sequence[SolverSpec],
    options: Options,
    tolerance_mm: float = 5.0,
    at_m: NDArray[np.float64] | None = None,
) -> tuple[Verdict, Path]:
    """Check, solve, judge, and leave everything in a folder; returns the verdict and the page."""
    from hecbench.report import html, pictures
    from hecbench.running import calibrating

    with console.Progress(specs) as progress:
        examined = calibrating.examine(recording, options.segmenter)
        for note in examined.segmented.recording.notes:
            console.say(note)
        estimates = calibrating.solved(examined, specs, options, progress.start, progress.done)
        progress.writing()
        found = calibrating.judged(examined, specs, estimates, tolerance_mm, at_m)
        for line in calibrating.Calibration(found, examined.evidence()).save(out):
            console.say(line)
        if found.recommended is not None:
            pictures.write(examined.segmented.recording, found.recommended, out)
        return found, html.write(out).path


def _place(text: str | None) -> NDArray[np.float64] | None:
    if text is None:
        return None
    import numpy as np

    try:
        place = np.array([float(number) for number in text.split(",")])
    except ValueError:
        place = np.zeros(0)
    if place.shape != (3,) or not np.isfinite(place).all():
        raise InputError(f"--at {text}: give three numbers of metres, as in --at 0.4,0,0.2")
    return place
