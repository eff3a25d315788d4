"""Unpaired training pictures: robots as a camera sees them, cut out, and robots in the flat colours of their model."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from hecbench_plugins.perception.family import Family
from hecbench_plugins.perception.pictures import Example, PictureMaker

Floats = NDArray[np.float32]

_KEEP = 400
"""Examples that are kept and drawn from; so many are drawn first, then one more for each picture."""
_LEAST_SHARE = 0.03
"""Of the picture, by the robot."""


class CutOut(NamedTuple):
    """A picture (3, S, S) in [-1, 1], black around the robot, and its mask (1, S, S)."""

    picture: Floats
    mask: Floats


def as_photographed(example: Example) -> CutOut:
    """The visible robot of an example, cut out by its mask."""
    mask = cv2.resize(example.shares[..., -1], example.image.shape[1::-1]).astype(np.float32) / 255
    cut = example.image.astype(np.float32) / 255 * mask[..., None]
    return CutOut(np.ascontiguousarray(2 * cut.transpose(2, 0, 1) - 1), mask[None])


def as_drawn(example: Example, palette: NDArray[np.float64]) -> CutOut:
    """The same robot in the colours of its model, where it is visible."""
    shares = cv2.resize(example.shares[..., :-1], example.image.shape[1::-1]).astype(np.float32) / 255
    visible = as_photographed(example).mask
    flat = (shares @ palette.astype(np.float32)) * visible[0][..., None]
    return CutOut(np.ascontiguousarray(2 * flat.transpose(2, 0, 1) - 1), visible)


class Pairs:
    """Draws examples of a family and hands out unpaired pictures of both kinds."""

    def __init__(self, family: Family, size: int, seed: tuple[int, ...], keep: int = _KEEP) -> None:
        self.palette = family.palette
        self.maker, self.rng, self.keep = PictureMaker(family, size, seed), np.random.default_rng(seed), keep
        self.examples: list[Example] = []

    def draw(self) -> None:
        """Draw the next example that shows enough of a robot, in place of the oldest when there are enough."""
        while True:
            example = self.maker.example()
            if (example.shares[..., -1] / 255).mean() > _LEAST_SHARE:
                break
        self.examples = [*self.examples[1 - self.keep :], example]

    def next(self) -> tuple[CutOut, CutOut]:
        """A photographed and a drawn robot of two examples."""
        self.draw()
        first, second = (self.examples[i] for i in self.rng.integers(0, len(self.examples), 2))
        return as_photographed(first), as_drawn(second, self.palette)
