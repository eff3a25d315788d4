"""The newest training pictures, each shown several times while others are drawn."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hecbench_plugins.perception.pictures import PictureMaker


class Pool:
    """A ring of `capacity` pictures in memory."""

    def __init__(self, maker: PictureMaker, capacity: int) -> None:
        side, family = maker.size, maker.family
        self.maker, self.drawn = maker, 0
        self.images = np.zeros((capacity, side, side, 3), np.uint8)
        self.shares = np.zeros((capacity, side // 2, side // 2, len(family.palette) + 1), np.uint8)
        self.keypoints = np.zeros((capacity, family.keypoint_count, 2), np.float32)

    def __len__(self) -> int:
        return min(self.drawn, len(self.images))

    def draw(self, count: int) -> None:
        """Replace the `count` oldest pictures by new ones."""
        for _ in range(count):
            place, example = self.drawn % len(self.images), self.maker.example()
            self.images[place], self.shares[place] = example.image, example.shares
            self.keypoints[place] = example.keypoints
            self.drawn += 1

    def batch(
        self, count: int, newest: int, rng: np.random.Generator
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.float32]]:
        """Images, shares and keypoints of `count` pictures: the `newest` ones, and others at random."""
        newest = min(newest, count, len(self))
        last = (self.drawn - 1 - np.arange(newest)) % len(self.images)
        chosen = np.r_[last, rng.integers(0, len(self), count - newest)]
        return self.images[chosen], self.shares[chosen], self.keypoints[chosen]
