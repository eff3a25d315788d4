"""A training run: seeded, resumable, on one thread by default, with a curve of its losses; whatever the network.

AdamW (Loshchilov and Hutter 2019) with a cosine schedule over the time that is given; the answer is a running mean of
the weights (Polyak and Juditsky 1992).
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import ClassVar, Protocol

import numpy as np
import torch
from torch import Tensor, nn

from hecbench.errors import InputError
from hecbench_plugins.perception import checkpoint
from hecbench_plugins.perception.checkpoint import Progress
from hecbench_plugins.perception.family import Family
from hecbench_plugins.perception.plan import Plan
from hecbench_plugins.perception.processor import prepared

CHECKPOINT = "checkpoint.safetensors"

_WARM_UP_STEPS, _LAST_RATE = 100, 0.01
_WEIGHT_DECAY, _BETAS, _GRADIENT_LIMIT = 0.02, (0.9, 0.99), 5.0
_AVERAGE_EVERY, _KEEP = 4, 0.98
_SAVE_SECONDS, _REPORT_SECONDS = 120.0, 60.0


class Terms(Protocol):
    """The named terms of one batch's loss."""

    def __iter__(self) -> Iterator[Tensor]: ...

    def total(self) -> Tensor:
        """The weighed sum, which is minimised."""
        ...


class Run(ABC):
    """A run; a folder with a checkpoint goes on where it ended."""

    term_names: ClassVar[tuple[str, ...]]
    """Of the loss, in the order of the curve."""

    def __init__(self, plan: Plan, say: Callable[[str], None]) -> None:
        self.plan, self.say = plan, say
        self.device = prepared(plan.threads, plan.seed)
        self.family = Family.of(plan.robots)
        self.net = self.network()
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
        if self.progress.history[-1:] != [str(plan)]:
            self.progress.history.append(str(plan))

    @abstractmethod
    def network(self) -> nn.Module:
        """A new network."""

    @abstractmethod
    def prepare(self) -> None:
        """Draw the pictures that the first step needs."""

    @abstractmethod
    def terms(self) -> Terms:
        """The losses of the next batch."""

    @property
    def path(self) -> Path:
        """Of the checkpoint."""
        return self.plan.out / CHECKPOINT

    def averaged_network(self) -> nn.Module:
        """The network with the running mean of the weights, which is the run's answer."""
        net = self.network()
        net.load_state_dict(self.average)
        return net

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
            self.begin_from(self.plan.start_from)
        return {}

    def begin_from(self, path: Path) -> None:
        """Take the first weights from another run's checkpoint."""
        tensors, _ = checkpoint.read(path)
        checkpoint.load_weights(self.net, tensors, "average", path)

    def run(self) -> None:
        """Train until the plan's end; the checkpoint is written every few minutes and at the end."""
        began, before = time.monotonic(), self.progress.seconds
        saved = reported = began
        recent: list[list[float]] = []
        self.net.train()
        if self._done() < 1:
            self.prepare()
        while (done := self._done()) < 1:
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
        terms = self.terms()
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

    def _report(self, recent: list[list[float]]) -> None:
        p, means = self.progress, np.mean(recent, 0)
        p.curve.append([round(p.seconds), p.step, *(round(float(v), 4) for v in means)])
        terms = ", ".join(f"{name} {value:.3f}" for name, value in zip(self.term_names, means, strict=True))
        share = f"{100 * self._done():.0f} %"
        self.say(f"{p.seconds / 60:.0f} min, {share}, step {p.step}, {p.drawn} pictures: {terms}")
