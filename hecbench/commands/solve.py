"""The verb `solve`."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from hecbench.commands import choices, console
from hecbench.errors import HecbenchError


@click.command()
@click.argument("recording", type=choices.ANY_PATH)
@choices.solvers
@choices.segmenter
@choices.unknown
@click.option("--views", type=click.IntRange(min=1), help="Use this many samples, drawn with --seed.")
@click.option(
    "--init", type=choices.FILE, help="An estimate to start from instead of initial_parent_T_camera."
)
@choices.held_out
@choices.check
@choices.timeout
@choices.memory
@click.option("--out", type=choices.FOLDER, help="Write each estimate to DIR/<solver>.json.")
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
    init: Path | None,
    held_out: bool | None,
    check: bool,
    timeout_s: float | None,
    memory_mb: int | None,
    out: Path | None,
    seed: int,
    as_json: bool,
) -> None:
    """Calibrate one RECORDING; the best estimate comes first."""
    from hecbench import diagnose, preparation
    from hecbench.estimate import Status, best_first
    from hecbench.report.tables import Group, table
    from hecbench.running import planning, solving

    loaded = planning.adjusted(preparation.load_recording(recording), views, init, seed)
    specs = planning.with_unknowns(planning.solvers_for(solvers, loaded, segmenter), unknown)
    if not specs:
        raise HecbenchError(
            f"{recording}: no ready solver can use what it offers: {', '.join(sorted(loaded.offers()))}"
        )
    options = choices.run_options(seed, held_out, segmenter, timeout_s, memory_mb)
    ready = preparation.prepare(loaded)
    prepared = preparation.segmented(ready, segmenter)
    for note in prepared.recording.notes:
        console.say(note)
    findings = [finding.to_json() for finding in diagnose.check(loaded, ready)] if check else []
    critical = console.print_critical(findings, loaded.name)
    estimates = []
    with console.Progress(specs) as progress:
        origin = solving.provenance(loaded, options)
        for estimate in solving.each_solved(prepared, specs, options, origin, progress.start):
            progress.done(estimate)
            estimates.append(estimate)
    estimates = best_first(estimates)
    for estimate in estimates if out else ():
        estimate.save(Path(str(out)) / f"{estimate.solver}.json")
    if as_json:
        console.print_json([estimate.to_json() for estimate in estimates])
    else:
        console.print_table(table(Group(loaded.name, tuple(estimates), is_level=False)))
        console.print_answer(estimates[0], do_not_use=critical)
    answered = [estimate.status is Status.OK for estimate in estimates]
    if critical:
        sys.exit(3)
    if not any(answered) or (solvers and not all(answered)):
        sys.exit(1)
