"""The verb `solve`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hecbench.commands import choices, console
from hecbench.errors import HecbenchError

if TYPE_CHECKING:
    from hecbench.estimate import Estimate
    from hecbench.running.calibrating import Examined
    from hecbench.verdict import Verdict


@click.command()
@click.argument("recording", type=choices.ANY_PATH)
@choices.solvers
@choices.segmenter
@choices.unknown
@click.option("--views", type=click.IntRange(min=1), help="Use this many samples, drawn with --seed.")
@click.option(
    "--init",
    metavar="START",
    help="Start from an estimate, a 4x4 in JSON, 'x y z roll pitch yaw', or 'looking-at x y z'.",
)
@choices.held_out
@choices.check
@choices.timeout
@choices.memory
@click.option(
    "--out", type=choices.FOLDER, help="Write each estimate to DIR/<solver>.json, for `report` and `export`."
)
@choices.threads
@choices.no_cache
@choices.seed
@choices.as_json
def solve(
    recording: Path,
    solvers: tuple[str, ...],
    segmenter: str | None,
    unknown: tuple[str, ...],
    views: int | None,
    init: str | None,
    held_out: bool | None,
    check: bool,
    timeout_s: float | None,
    memory_mb: int | None,
    out: Path | None,
    seed: int,
    as_json: bool,
) -> None:
    """Calibrate one RECORDING; the best estimate comes first."""
    from hecbench import preparation
    from hecbench.estimate import Status, best_first
    from hecbench.report.tables import Group, table
    from hecbench.running import calibrating, planning

    loaded = planning.adjusted(preparation.load_recording(recording), views, init, seed)
    specs = planning.with_unknowns(planning.solvers_for(solvers, loaded, segmenter), unknown)
    if not specs:
        raise HecbenchError(
            f"{recording}: no ready solver can use what it offers: {', '.join(sorted(loaded.offers()))}"
        )
    options = choices.run_options(seed, held_out, segmenter, timeout_s, memory_mb)
    with console.Progress(specs) as progress:
        examined = calibrating.examine(loaded, segmenter, check)
        for note in examined.segmented.recording.notes:
            console.say(note)
        critical = console.print_critical(examined.findings_json, loaded.name)
        estimates = best_first(calibrating.solved(examined, specs, options, progress.start, progress.done))
    verdict = calibrating.judged(examined, specs, estimates) if check else None
    if verdict is not None and loaded.truth_parent_T_camera is None:
        estimates = verdict.recommended_first(estimates)
    if out is not None:
        _save(estimates, examined, verdict, out)
    if as_json:
        console.print_json([estimate.to_json() for estimate in estimates])
    else:
        console.print_table(table(Group(loaded.name, tuple(estimates), is_level=False)))
        if verdict is not None:
            console.print_verdict(verdict)
        else:
            console.print_answer(estimates[0])
    answered = [estimate.status is Status.OK for estimate in estimates]
    if critical:
        sys.exit(3)
    if not any(answered) or (solvers and not all(answered)):
        sys.exit(1)


def _save(estimates: Sequence[Estimate], examined: Examined, verdict: Verdict | None, out: Path) -> None:
    """A file for each estimate, and what `report` shows beside them."""
    from hecbench.report import pictures
    from hecbench.storage import evidence, results

    for estimate in estimates:
        estimate.save(out / f"{estimate.solver}.json")
    evidence.save(examined.evidence(), out)
    if verdict is not None:
        verdict.save(out / results.VERDICT_NAME)
    if verdict is not None and verdict.recommended is not None:
        pictures.write(examined.segmented.recording, verdict.recommended, out)
