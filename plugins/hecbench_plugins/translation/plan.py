"""The settings of a run, checked before anything heavy is loaded."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from hecbench.errors import InputError
from hecbench_plugins.perception.plan import LARGEST_PX, require_processor, require_within

_SMALL_PX = 128
"""Sizes up to this are for processors and get a small generator; the published ones are for 256 px."""
_MULTIPLE = 16


class Method(StrEnum):
    """The translators of the paper's Table III, as plugins are called."""

    CYCLEGAN = "cyclegan"
    """Zhu et al. 2017."""
    CUT = "cut"
    """Park et al. 2020."""
    GEOMASKGAN = "geomaskgan"
    """Lu et al. 2022: CycleGAN whose masks, by a network that learns them, shall not change."""
    CYCLEGAN_MASK = "cyclegan_mask"
    """DRHeC's: CycleGAN with the mask loss |B(G(x)) - B(x)|."""


@dataclass(frozen=True)
class Plan:
    """Settings of a run.

    Attributes:
        method: which losses.
        robots: names or URDF files, drawn in both kinds of picture.
        out: folder for the checkpoint, the curve and the model.
        steps: of one picture of each kind. The rate is constant for the first half, then falls to 0.
        size: px of the square pictures.
    """

    method: Method
    robots: tuple[str, ...]
    out: Path
    steps: int
    seed: int = 0
    size: int = 256
    threads: int = 1

    def check(self) -> None:
        """Refuse what cannot be run.

        Raises:
            InputError: naming the option and the cure.
        """
        if self.steps < 2:
            raise InputError(f"--steps must be 2 or more, is {self.steps}")
        if self.size % _MULTIPLE:
            raise InputError(
                f"--size must be a multiple of {_MULTIPLE}, {2 * _MULTIPLE} or more, is {self.size}"
            )
        require_within("--size", self.size, 2 * _MULTIPLE, LARGEST_PX)
        require_processor(self.seed, self.threads)

    @property
    def width(self) -> int:
        """Channels of the generator's first layer; 64 as published."""
        return 16 if self.size <= _SMALL_PX else 64

    @property
    def blocks(self) -> int:
        """Residual blocks of the generator; 9 as published for 256 px."""
        return 4 if self.size <= _SMALL_PX else 9

    def __str__(self) -> str:
        return f"{self.method}, {self.size} px, {self.width} channels, {self.blocks} blocks, seed {self.seed}"
