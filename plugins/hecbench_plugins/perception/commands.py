"""The verb ``hecbench train``."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import click

from hecbench.errors import HecbenchError, InputError

_FOLDER = click.Path(path_type=Path, file_okay=False)
_NEEDED = ("torch", "safetensors", "onnx")


@click.group()
def train() -> None:
    """Train networks on pictures that are drawn here."""


@train.command()
@click.option(
    "--robot", "robots", multiple=True, required=True, help="A known robot or a URDF file; repeatable."
)
@click.option("--out", required=True, type=_FOLDER, help="Folder of the run; a run found there goes on.")
@click.option("--hours", default=3.0, show_default=True, help="End after this time.")
@click.option("--steps", type=int, help="End after so many steps, if that is sooner.")
@click.option("--seed", default=0, show_default=True)
@click.option("--size", default=192, show_default=True, help="Side of the drawn pictures, px.")
@click.option("--batch", default=8, show_default=True, help="Pictures per step.")
@click.option("--threads", default=1, show_default=True, help="Of the processor.")
@click.option(
    "--start-from", type=click.Path(path_type=Path, dir_okay=False), help="A checkpoint to start from."
)
@click.option("--backgrounds", type=_FOLDER, help="Folder of photographs without a robot, drawn behind it.")
def perception(
    robots: tuple[str, ...],
    out: Path,
    hours: float,
    steps: int | None,
    seed: int,
    size: int,
    batch: int,
    threads: int,
    start_from: Path | None,
    backgrounds: Path | None,
) -> None:
    """Train the network that finds robots in photographs, and write it as OUT/model.

    The run needs no data. It may be stopped at any moment: the same command goes on from its last checkpoint.
    """
    missing = [name for name in _NEEDED if find_spec(name) is None]
    if missing:
        raise InputError(f"training needs {' and '.join(missing)}: pip install 'hecbench[torch]'")
    from hecbench_plugins.perception.plan import Plan

    plan = Plan(
        robots,
        out,
        hours,
        steps,
        seed=seed,
        size=size,
        batch=batch,
        threads=threads,
        start_from=start_from,
        backgrounds=backgrounds,
    )
    plan.check()
    from hecbench_plugins.perception.training import Training

    training = Training(plan, click.echo)
    try:
        training.run()
    except OSError as error:
        raise HecbenchError(
            f"{out}: cannot be written ({error.strerror}); make room and start again"
        ) from error

    from hecbench_plugins.perception.product import write_model

    click.echo(f"{write_model(training)}: the model, its card and its curve")
