"""Fit the network to drawn pictures; a run that goes on computes what it would have computed without a stop."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from hecbench_plugins.perception import checkpoint
from hecbench_plugins.perception.exposure import exposed
from hecbench_plugins.perception.run import Run
from hecbench_plugins.perception.transfer import take_sight
from hecbench_plugins.regression.losses import Losses, losses
from hecbench_plugins.regression.network import RegressionNet
from hecbench_plugins.regression.plan import Plan
from hecbench_plugins.regression.shots import Shots
from hecbench_plugins.regression.sketches import Sketches, fit_dense

_FIRST_PICTURES = 256


class Training(Run):
    """A run for one robot."""

    term_names = Losses._fields
    plan: Plan
    net: RegressionNet

    @cached_property
    def shots(self) -> Shots:
        """The pictures."""
        return Shots(self.plan, self.family)

    def network(self) -> RegressionNet:
        """For the robot's colours, keypoints and joints."""
        posture = 2 * (len(self.family.arms[0].model.joint_names) - 1)
        return RegressionNet(len(self.family.palette), self.family.keypoint_count, posture)

    def begin_from(self, path: Path) -> None:
        """Take the first weights from another run's checkpoint, or the convolutions of a perception model's folder."""
        if not path.is_dir():
            super().begin_from(path)
            return
        self.shots.draw_until(self._first)
        batch = self.shots.batch(self._rng())
        take_sight(self.net, path, batch.pictures)

    def prepare(self) -> None:
        """Fit the dense layers to sketches, if the run is new, and draw the pictures of the first step."""
        learned = self.plan.start_from is not None and not self.plan.start_from.is_dir()
        if self.progress.step == 0 and self.plan.sketches and not learned:
            rng = np.random.default_rng((self.plan.seed, 3))
            fit_dense(self.net.dense, Sketches(self.family.arms[0], rng), self.plan.sketches, self.say)
            self.average = checkpoint.averaged(self.net)
        self.shots.draw_until(self._first + self.progress.step * self.plan.pictures_per_step)

    def terms(self) -> Losses:
        """The losses of the next batch."""
        step = self.progress.step + 1
        self.shots.draw_until(self._first + step * self.plan.pictures_per_step)
        rng = self._rng()
        batch = self.shots.batch(rng)
        n = len(batch.pictures)
        x = exposed(batch.pictures, *(_normal(rng, n, channels) for channels in (1, 3, 1)))
        x = x.to(self.device).contiguous(memory_format=torch.channels_last)
        with torch.autocast(self.device, torch.bfloat16):
            places = self.net.places(x)
        numbers = self.net.dense(places, batch.postures.to(self.device))
        return losses(numbers, *(one.to(self.device) for one in batch[2:]))

    @property
    def _first(self) -> int:
        return min(_FIRST_PICTURES, self.plan.capacity)

    def _rng(self) -> np.random.Generator:
        """Of the next step alone."""
        return np.random.default_rng((self.plan.seed, 2, self.progress.step))


def _normal(rng: np.random.Generator, count: int, channels: int) -> Tensor:
    return torch.from_numpy(rng.normal(size=(count, channels, 1, 1)).astype(np.float32))
