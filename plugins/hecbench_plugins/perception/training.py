"""Fit the network to drawn pictures.

Every batch has one of several sizes, which is cheap variety in scale.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional as F

from hecbench_plugins.perception.exposure import exposed
from hecbench_plugins.perception.losses import Losses, losses
from hecbench_plugins.perception.network import PerceptionNet
from hecbench_plugins.perception.own_cell import Cell, WithOwnCells
from hecbench_plugins.perception.pictures import PictureMaker
from hecbench_plugins.perception.plan import STRIDE, Plan
from hecbench_plugins.perception.pool import Pool
from hecbench_plugins.perception.run import Run
from hecbench_plugins.perception.transfer import take_sight

_SIZES = (2 / 3, 5 / 6, 1.0)
"""Of the drawn pictures; each batch is shrunk to one of them."""
_FIRST_PICTURES = 256


class Training(Run):
    """A run for robots that share a network."""

    term_names = Losses._fields
    net: PerceptionNet

    def __init__(self, plan: Plan, say: Callable[[str], None]) -> None:
        super().__init__(plan, say)
        seed = (plan.seed, self.progress.step)
        self.rng = np.random.default_rng(seed)
        drawn = PictureMaker(self.family, plan.size, seed, plan.backgrounds)
        cells = [Cell.of(path, self.family) for path in plan.adapt]
        self.pool = Pool(WithOwnCells(drawn, cells) if cells else drawn, max(plan.capacity, plan.batch))

    def network(self) -> PerceptionNet:
        """For the family's colours and keypoints."""
        return PerceptionNet(len(self.family.palette), self.family.keypoint_count)

    def begin_from(self, path: Path) -> None:
        """Take the first weights from another run's checkpoint, or from a model's folder."""
        if not path.is_dir():
            super().begin_from(path)
            return
        maker = PictureMaker(self.family, self.plan.size, self.plan.seed, self.plan.backgrounds)
        pictures = np.stack([maker.example().image for _ in range(_FIRST_PICTURES // 4)])
        take_sight(self.net, path, _channels_first(pictures))

    def prepare(self) -> None:
        """Draw enough for a batch, and a few more."""
        self.pool.draw(max(self.plan.batch, min(_FIRST_PICTURES, self.pool.capacity)))

    def terms(self) -> Losses:
        """The losses of the next batch."""
        self.pool.draw(self.plan.pictures_per_step)
        images, shares, points, known = self._batch()
        with torch.autocast(self.device, torch.bfloat16):
            logits = self.net(images)
        return losses(logits.float(), shares, points, known)

    def _batch(self) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Images (B, 3, S, S) in [0, 1], shares (B, C + 1, S/2, S/2), points (B, K, 2) in cells, known (B,)."""
        batch = self.pool.batch(self.plan.batch, 2 * self.plan.pictures_per_step, self.rng)
        side = STRIDE * max(1, round(self.plan.size * self.rng.choice(_SIZES) / STRIDE))
        x, t = (_channels_first(one).to(self.device) for one in batch[:2])
        uv, known = (torch.from_numpy(one).to(self.device) for one in batch[2:])
        scale = side / self.plan.size
        if scale != 1:
            x = F.interpolate(x, size=(side, side), mode="bilinear", antialias=True)
            t = F.interpolate(t, size=(side // 2, side // 2), mode="bilinear", antialias=True)
        x = exposed(
            x, torch.randn(len(x), 1, 1, 1), torch.randn(len(x), 3, 1, 1), torch.randn(len(x), 1, 1, 1)
        )
        return x.contiguous(memory_format=torch.channels_last), t, (uv + 0.5) * (scale / 2) - 0.5, known


def _channels_first(pictures: NDArray[np.uint8]) -> Tensor:
    """(B, C, H, W) in [0, 1] of pictures (B, H, W, C)."""
    return torch.from_numpy(pictures).permute(0, 3, 1, 2).float() / 255
