"""The verb of episodes: ``hecbench episodes ROOT`` calibrates the camera of every episode of a LeRobot dataset."""

from __future__ import annotations

from pathlib import Path

import click

from hecbench.commands import completion


@click.command()
@click.argument("root", type=click.Path(path_type=Path, file_okay=False), metavar="ROOT")
@click.option("--camera", help="Its key, such as observation.images.top; default: the only one.")
@click.option(
    "--solver",
    "solvers",
    multiple=True,
    metavar="NAME",
    shell_complete=completion.plugins("solver"),
    help="Default: render_gn_free.",
)
@click.option(
    "--out", type=click.Path(path_type=Path, file_okay=False), help="Default: ROOT_cameras beside the set."
)
@click.option("--jobs", type=click.IntRange(min=1), default=1, show_default=True, help="Processes.")
@click.option("--executor", metavar="URL", help="A dask scheduler instead of processes.")
@click.option("--seed", type=int, default=0, show_default=True)
@click.option("--resume", is_flag=True, help="Go on with an unfinished OUT.")
def episodes(
    root: Path,
    camera: str | None,
    solvers: tuple[str, ...],
    out: Path | None,
    jobs: int,
    executor: str | None,
    seed: int,
    resume: bool,
) -> None:
    """Calibrate a camera in every episode of the LeRobot dataset ROOT, and say in which it stands elsewhere.

    OUT gets a native recording of each episode, the estimates, and cameras.json.
    """
    from hecbench.commands import console
    from hecbench.report.tables import Table
    from hecbench_datasets.episodes import as_recordings, calibrated, rows

    folder = out or root.resolve().parent / f"{root.resolve().name}_cameras"
    recordings, faults = as_recordings(root, camera, folder / "recordings", jobs)
    for fault in faults:
        console.say(fault)
    found = calibrated(recordings, solvers or ("render_gn_free",), folder, jobs, executor, seed, resume)
    header = ("episode", "solver", "status", "x y z mm", "off mm", "off deg", "")
    console.print_table(Table(f"Cameras of {root}", header, rows(found), left=3))
    click.echo(
        f"{folder / 'cameras.json'}: {len(found)} episodes, {sum(one.drifted for one in found)} drifted"
    )
