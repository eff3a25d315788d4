"""Fit the network to drawn pictures: seeded, resumable, on one thread by default.

AdamW (Loshchilov and Hutter 2019) with a cosine schedule over the time that is given; the answer is a running mean of
the weights (Polyak and Juditsky 1992). Every batch has one of several sizes, which is cheap variety in scale.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from hecbench.errors import InputError
from hecbench_plugins.perception import checkpoint
from hecbench_plugins.perception.checkpoint import Progress
from hecbench_plugins.perception.family import Family
from hecbench_plugins.perception.losses import Losses, losses
from hecbench_plugins.perception.network import PerceptionNet
from hecbench_plugins.perception.pictures import PictureMaker
from hecbench_plugins.perception.plan import STRIDE, Plan
from hecbench_plugins.perception.pool import Pool
from hecbench_plugins.perception.processor import prepared

CHECKPOINT = "checkpoint.safetensors"

_SIZES = (2 / 3, 5 / 6, 1.0)
"""Of the drawn pictures; each batch is shrunk to one of them."""
_WARM_UP_STEPS, _LAST_RATE = 100, 0.01
_WEIGHT_DECAY, _BETAS, _GRADIENT_LIMIT = 0.02, (0.9, 0.99), 5.0
_AVERAGE_EVERY, _KEEP = 4, 0.98
_SAVE_SECONDS, _REPORT_SECONDS = 120.0, 60.0
_FIRST_PICTURES = 256
_GAIN, _CHANNEL_GAIN, _OFFSET = 0.15, 0.05, 0.04
"""Standard deviations of a change of exposure, made anew each time that a picture is shown."""


class Training:
    """A run; a folder with a checkpoint goes on where it ended."""

    def __init__(self, plan: Plan, say: Callable[[str], None]) -> None:
        self.plan, self.say = plan, say
        self.device = prepared(plan.threads, plan.seed)
        self.family = Family.of(plan.robots)
        self.net = PerceptionNet(len(self.family.palette), self.family.keypoint_count)
        self.progress = Progress(self.family.names, plan.seed)
        tensors = self._start()
        self.net.to(self.device, memory_format=torch.channels_last)  # type: ignore[call-overload]
        self.average = checkpoint.averaged(self.net)
        self.optimiser = torch.optim.AdamW(
            self.net.parameters(), lr=plan.rate, weight_decay=_WEIGHT_DECAY, betas=_BETAS, fused=True
        )
        if tensors:
            for name in self.average:
                self.average[name] = tensors[f"average/{name}"].to(self.device)
            checkpoint.load_moments(self.optimiser, self.net, tensors)
        self.progress.history.append(str(plan))
        seed = (plan.seed, self.progress.step)
        self.rng = np.random.default_rng(seed)
        self.pool = Pool(
            PictureMaker(self.family, plan.size, seed, plan.backgrounds), max(plan.capacity, plan.batch)
        )

    @property
    def path(self) -> Path:
        """Of the checkpoint."""
        return self.plan.out / CHECKPOINT

    def _start(self) -> dict[str, Tensor]:
        """Weights of the run's own checkpoint, or else of another; returns the former's tensors."""
        if self.path.exists():
            tensors, self.progress = checkpoint.read(self.path)
            if self.progress.robots != self.family.names:
                raise InputError(
                    f"{self.path}: a run for {', '.join(self.progress.robots)}, not"
                    f" {', '.join(self.family.names)}: give another --out"
                )
            checkpoint.load_weights(self.net, tensors, "weights", self.path)
            self.say(f"{self.path}: goes on after step {self.progress.step}")
            return tensors
        if self.plan.start_from is not None:
            tensors, _ = checkpoint.read(self.plan.start_from)
            checkpoint.load_weights(self.net, tensors, "average", self.plan.start_from)
        return {}

    def run(self) -> None:
        """Train until the plan's end; the checkpoint is written every few minutes and at the end."""
        began, before = time.monotonic(), self.progress.seconds
        saved = reported = began
        recent: list[list[float]] = []
        self.net.train()
        self.pool.draw(max(self.plan.batch, min(_FIRST_PICTURES, self.pool.images.shape[0])))
        while (done := self._done()) < 1:
            self.pool.draw(self.plan.pictures_per_step)
            recent = [*recent[-199:], self._step(done)]
            now = time.monotonic()
            self.progress.seconds = before + now - began
            if now - reported > _REPORT_SECONDS:
                reported = now
                self._report(recent)
            if now - saved > _SAVE_SECONDS:
                saved = now
                self.save()
        if recent:
            self._report(recent)
        self.save()

    def save(self) -> None:
        """Write the checkpoint."""
        checkpoint.write(self.path, self.net, self.average, self.optimiser, self.progress)

    def _done(self) -> float:
        by_time = self.progress.seconds / (3600 * self.plan.hours)
        return max(by_time, self.progress.step / self.plan.steps if self.plan.steps else 0.0)

    def _step(self, done: float) -> list[float]:
        warm = min(1.0, (self.progress.step + 1) / _WARM_UP_STEPS)
        cosine = _LAST_RATE + (1 - _LAST_RATE) * 0.5 * (1 + np.cos(np.pi * done))
        for group in self.optimiser.param_groups:
            group["lr"] = self.plan.rate * warm * cosine
        images, shares, points = self._batch()
        with torch.autocast(self.device, torch.bfloat16):
            logits = self.net(images)
        terms: Losses = losses(logits.float(), shares, points)
        self.optimiser.zero_grad(set_to_none=True)
        terms.total().backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(self.net.parameters(), _GRADIENT_LIMIT)
        self.optimiser.step()
        self.progress.step += 1
        self.progress.drawn += self.plan.pictures_per_step
        if self.progress.step % _AVERAGE_EVERY == 0:
            self.progress.averaged += 1
            keep = min(_KEEP, self.progress.averaged / (self.progress.averaged + 10))
            checkpoint.follow(self.average, self.net, keep)
        return [float(term.detach()) for term in terms]

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
        n, random = len(x), torch.randn
        gain = 1 + _GAIN * random(n, 1, 1, 1) + _CHANNEL_GAIN * random(n, 3, 1, 1)
        x = (x * gain.to(x) + _OFFSET * random(n, 1, 1, 1).to(x)).clamp(0, 1)
        return x.contiguous(memory_format=torch.channels_last), t, (uv + 0.5) * (scale / 2) - 0.5

    def _report(self, recent: list[list[float]]) -> None:
        p, means = self.progress, np.mean(recent, 0)
        p.curve.append([round(p.seconds), p.step, *(round(float(v), 4) for v in means)])
        terms = ", ".join(f"{name} {value:.3f}" for name, value in zip(Losses._fields, means, strict=True))
        share = f"{100 * self._done():.0f} %"
        self.say(f"{p.seconds / 60:.0f} min, {share}, step {p.step}, {p.drawn} pictures: {terms}")
