"""Fit the network to drawn pictures.

Every batch has one of several sizes, which is cheap variety in scale.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from hecbench_plugins.perception.exposure import exposed
from hecbench_plugins.perception.losses import Losses, losses
from hecbench_plugins.perception.network import PerceptionNet
from hecbench_plugins.perception.pictures import PictureMaker
from hecbench_plugins.perception.plan import STRIDE, Plan
from hecbench_plugins.perception.pool import Pool
from hecbench_plugins.perception.run import Run

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
        self.pool = Pool(
            PictureMaker(self.family, plan.size, seed, plan.backgrounds), max(plan.capacity, plan.batch)
        )

    def network(self) -> PerceptionNet:
        """For the family's colours and keypoints."""
        return PerceptionNet(len(self.family.palette), self.family.keypoint_count)

    def prepare(self) -> None:
        """Draw enough for a batch, and a few more."""
        self.pool.draw(max(self.plan.batch, min(_FIRST_PICTURES, self.pool.images.shape[0])))

    def terms(self) -> Losses:
        """The losses of the next batch."""
        self.pool.draw(self.plan.pictures_per_step)
        images, shares, points = self._batch()
        with torch.autocast(self.device, torch.bfloat16):
            logits = self.net(images)
        return losses(logits.float(), shares, points)

    def _batch(self) -> tuple[Tensor, Tensor, Tensor]:
        """Images (B, 3, S, S) in [0, 1], shares (B, C + 1, S/2, S/2), points (B, K, 2) in cells."""
        images, shares, points = self.pool.batch(self.plan.batch, 2 * self.plan.pictures_per_step, self.rng)
        side = STRIDE * max(1, round(self.plan.size * self.rng.choice(_SIZES) / STRIDE))
        x = torch.from_numpy(images).to(self.device).permute(0, 3, 1, 2).float() / 255
        t = torch.from_numpy(shares).to(self.device).permute(0, 3, 1, 2).float() / 255
        uv = torch.from_numpy(points).to(self.device)
        scale = side / self.plan.size
        if scale != 1:
            x = F.interpolate(x, size=(side, side), mode="bilinear", antialias=True)
            t = F.interpolate(t, size=(side // 2, side // 2), mode="bilinear", antialias=True)
        x = exposed(
            x, torch.randn(len(x), 1, 1, 1), torch.randn(len(x), 3, 1, 1), torch.randn(len(x), 1, 1, 1)
        )
        return x.contiguous(memory_format=torch.channels_last), t, (uv + 0.5) * (scale / 2) - 0.5
