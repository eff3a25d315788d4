"""The verb ``hecbench train``."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Protocol, TypeVar

import click

from hecbench.errors import HecbenchError, InputError
from hecbench_plugins.translation.plan import Method

_FOLDER = click.Path(path_type=Path, file_okay=False)
_Decorator = Callable[[Callable[..., None]], Callable[..., None]]
_NEEDED = ("torch", "safetensors", "onnx")


class _Training(Protocol):
    def run(self) -> None: ...


_T = TypeVar("_T", bound=_Training)


def _require_torch(*others: str) -> None:
    missing = [name for name in (*_NEEDED, *others) if find_spec(name) is None]
    if missing:
        raise InputError(f"training needs {' and '.join(missing)}: pip install 'hecbench[torch]'")


def _all(*options: _Decorator) -> _Decorator:
    """One decorator of many, listed in this order."""

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        for option in reversed(options):
            command = option(command)
        return command

    return decorate


_run = _all(
    click.option("--out", required=True, type=_FOLDER, help="Folder of the run; a run found there goes on."),
    click.option("--seed", default=0, show_default=True),
    click.option("--threads", default=1, show_default=True, help="Of the processor."),
)
_drawing = _all(
    click.option("--steps", type=int, help="End after so many steps, if that is sooner."),
    click.option(
        "--backgrounds", type=_FOLDER, help="Folder of photographs without a robot, drawn behind it."
    ),
)


@click.group()
def train() -> None:
    """Train networks on pictures that are drawn here."""


@train.command()
@click.option(
    "--robot", "robots", multiple=True, required=True, help="A known robot or a URDF file; repeatable."
)
@click.option("--hours", default=3.0, show_default=True, help="End after this time.")
@click.option("--size", default=192, show_default=True, help="Side of the drawn pictures, px.")
@click.option("--batch", default=8, show_default=True, help="Pictures per step.")
@click.option(
    "--start-from",
    type=click.Path(path_type=Path),
    help="A checkpoint, or the folder or name of a perception model.",
)
@click.option(
    "--adapt",
    multiple=True,
    type=click.Path(path_type=Path),
    help="A recording of your own cell, without labels: a quarter of the pictures are its photographs. Repeatable.",
)
@_drawing
@_run
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
    adapt: tuple[Path, ...],
    backgrounds: Path | None,
) -> None:
    """Train the network that finds robots in photographs, and write it as OUT/model.

    The run needs no data. With --adapt, the camera that a recording's photographs confirm, with the robot's model, says
    what they show. The run may be stopped at any moment: the same command goes on from its last checkpoint.
    """
    _require_torch()
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
        start_from=start_from and _start(start_from),
        backgrounds=backgrounds,
        adapt=adapt,
    )
    plan.check()
    from hecbench_plugins.perception.product import write_model
    from hecbench_plugins.perception.training import Training

    _train(out, lambda: Training(plan, click.echo), write_model, "the model, its card and its curve")


@train.command()
@click.option("--robot", required=True, help="A known robot or a URDF file.")
@click.option("--hours", default=1.0, show_default=True, help="End after this time.")
@click.option("--batch", default=16, show_default=True, help="Pictures per step.")
@click.option(
    "--sketches",
    default=7000,
    show_default=True,
    help="Steps of the dense layers on keypoints alone, before any picture.",
)
@click.option(
    "--start-from",
    type=click.Path(path_type=Path),
    help="A checkpoint, or the folder or name of a perception model that has learned to see the robot.",
)
@_drawing
@_run
def regression(
    robot: str,
    out: Path,
    hours: float,
    steps: int | None,
    seed: int,
    batch: int,
    sketches: int,
    threads: int,
    start_from: Path | None,
    backgrounds: Path | None,
) -> None:
    """Train the network that answers the camera's pose from one picture, and write it as OUT/model.

    The run needs no data. It may be stopped at any moment: the same command goes on from its last checkpoint.
    """
    _require_torch("pytorch_kinematics")
    from hecbench_plugins.regression.plan import Plan

    plan = Plan(
        (robot,),
        out,
        hours,
        steps,
        seed=seed,
        batch=batch,
        sketches=sketches,
        threads=threads,
        start_from=start_from and _start(start_from),
        backgrounds=backgrounds,
    )
    plan.check()
    from hecbench_plugins.regression.product import write_model
    from hecbench_plugins.regression.training import Training

    _train(out, lambda: Training(plan, click.echo), write_model, "the model, its card and its curve")


@train.command()
@click.option("--method", required=True, type=click.Choice([str(method) for method in Method]))
@click.option(
    "--robot", "robots", multiple=True, required=True, help="A known robot or a URDF file; repeatable."
)
@click.option(
    "--steps", default=588_000, show_default=True, help="Pictures; the default is 400 epochs of 1470."
)
@click.option("--size", default=256, show_default=True, help="Side of the pictures, px; 64 for a processor.")
@_run
def translation(
    method: str, robots: tuple[str, ...], out: Path, steps: int, size: int, seed: int, threads: int
) -> None:
    """Train a translator of the paper on drawn pictures, and write it as OUT/model.

    The robots of lit, shadowed and degraded pictures are cut out and translated into flat colours. The run may be
    stopped at any moment: the same command goes on from its last checkpoint.
    """
    _require_torch()
    from hecbench_plugins.translation.plan import Plan

    plan = Plan(Method(method), robots, out, steps, seed=seed, size=size, threads=threads)
    plan.check()
    from hecbench_plugins.translation.training import Training, write_model

    _train(out, lambda: Training(plan, click.echo), write_model, "the translator and its card")


def _start(given: Path) -> Path:
    """A path, or the folder of the installed network of this name."""
    from hecbench_plugins.perception.choice import installed_folder

    return given if given.exists() else installed_folder(str(given)) or given


def _train(out: Path, begin: Callable[[], _T], write_model: Callable[[_T], Path], written: str) -> None:
    """Train to the end and write the model; say in one line that its folder or the memory is too small for it."""
    from hecbench_plugins.perception.run_folder import reserved

    try:
        with reserved(out):
            training = begin()
            training.run()
            click.echo(f"{write_model(training)}: {written}")
    except OSError as error:
        raise HecbenchError(
            f"{out}: cannot be written ({error.strerror}); make room and start again"
        ) from error
    except (MemoryError, RuntimeError) as error:
        if isinstance(error, RuntimeError) and "allocate" not in str(error):  # torch's word for it
            raise
        raise HecbenchError(
            f"{out}: the memory does not suffice; give smaller pictures or batches"
        ) from error
