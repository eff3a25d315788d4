"""The newest training pictures, each shown several times while others are drawn."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from hecbench_plugins.perception.family import Family
from hecbench_plugins.perception.pictures import Example


class Maker(Protocol):
    """What examples come from."""

    family: Family
    size: int

    def example(self) -> Example:
        """The next one."""
        ...


class Batch(NamedTuple):
    """B examples.

    Attributes:
        images: (B, S, S, 3).
        shares: (B, S/2, S/2, C + 2), of 255.
        points: (B, K, 2) px.
        visible_known: (B,).
    """

    images: NDArray[np.uint8]
    shares: NDArray[np.uint8]
    points: NDArray[np.float32]
    visible_known: NDArray[np.bool_]


class Pool:
    """A ring of `capacity` pictures in memory."""

    def __init__(self, maker: Maker, capacity: int) -> None:
        side, family = maker.size, maker.family
        self.maker, self.drawn = maker, 0
        self._all = Batch(
            np.zeros((capacity, side, side, 3), np.uint8),
            np.zeros((capacity, side // 2, side // 2, len(family.palette) + 1), np.uint8),
            np.zeros((capacity, family.keypoint_count, 2), np.float32),
            np.ones(capacity, bool),
        )

    def __len__(self) -> int:
        return min(self.drawn, self.capacity)

    @property
    def capacity(self) -> int:
        """Pictures that are kept."""
        return len(self._all.images)

    def draw(self, count: int) -> None:
        """Replace the `count` oldest pictures by new ones."""
        for _ in range(count):
            example, place = self.maker.example(), self.drawn % self.capacity
            self._all.images[place], self._all.shares[place] = example.image, example.shares
            self._all.points[place] = example.keypoints
            self._all.visible_known[place] = example.visible_known
            self.drawn += 1

    def batch(self, count: int, newest: int, rng: np.random.Generator) -> Batch:
        """`count` examples: the `newest` ones, and others at random."""
        newest = min(newest, count, len(self))
        last = (self.drawn - 1 - np.arange(newest)) % self.capacity
        chosen = np.r_[last, rng.integers(0, len(self), count - newest)]
        return Batch._make(kept[chosen] for kept in self._all)
