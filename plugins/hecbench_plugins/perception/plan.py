"""The settings of a training run, checked before anything heavy is loaded."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hecbench.errors import InputError

STRIDE = 32
"""The sides of every picture that the network takes are multiples of this, px."""
LARGEST_PX = 1024
"""Of a side of the drawn pictures."""
_LARGEST_BATCH, _MOST_THREADS, _LARGEST_SEED = 1024, 1024, 2**63 - 1


def require_within(option: str, value: int, least: int, most: int) -> None:
    """Refuse a number outside what an option takes.

    Raises:
        InputError: naming the option and its limits.
    """
    if not least <= value <= most:
        raise InputError(f"{option} must be {least} to {most}, is {value}")


def require_processor(seed: int, threads: int) -> None:
    """Refuse a seed or a number of threads that torch does not take; errors as of `require_within`."""
    require_within("--seed", seed, 0, _LARGEST_SEED)
    require_within("--threads", threads, 1, _MOST_THREADS)


@dataclass(frozen=True)
class Plan:
    """Settings of a run.

    Attributes:
        robots: names or URDF files.
        out: folder for the checkpoint, the curve and the model.
        hours: after so many the run ends; the rate falls to its end by then.
        steps: the same by steps, whichever is first; None: no limit.
        size: px of the drawn pictures, a multiple of 32.
        pictures_per_step: drawn anew.
        capacity: pictures that are kept.
        start_from: a checkpoint whose averaged weights are the start, or the folder of a model.
        backgrounds: a folder of photographs without a robot.
        adapt: recordings of one's own cell, whose photographs are among the pictures.
    """

    robots: tuple[str, ...]
    out: Path
    hours: float
    steps: int | None = None
    seed: int = 0
    size: int = 192
    batch: int = 8
    rate: float = 1.5e-3
    pictures_per_step: int = 1
    capacity: int = 8192
    threads: int = 1
    start_from: Path | None = None
    backgrounds: Path | None = None
    adapt: tuple[Path, ...] = ()

    def check(self) -> None:
        """Refuse what cannot be run.

        Raises:
            InputError: naming the option and the cure.
        """
        if not self.hours > 0:
            raise InputError(f"--hours must be positive, is {self.hours}")
        if self.steps is not None and self.steps < 1:
            raise InputError(f"--steps must be 1 or more, is {self.steps}")
        if self.size % STRIDE:
            raise InputError(f"--size must be a multiple of {STRIDE}, {2 * STRIDE} or more, is {self.size}")
        require_within("--size", self.size, 2 * STRIDE, LARGEST_PX)
        require_within("--batch", self.batch, 2, _LARGEST_BATCH)
        require_processor(self.seed, self.threads)

    def __str__(self) -> str:
        settings = (
            f"{self.size} px, batch {self.batch}, rate {self.rate:g}, {self.hours:g} h, seed {self.seed}"
        )
        if self.start_from:
            settings += f", started from {self.start_from.name}"
        if self.adapt:
            settings += f", adapted to {', '.join(path.name for path in self.adapt)}"
        return settings
