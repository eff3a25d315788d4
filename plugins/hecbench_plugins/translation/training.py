"""Fit a translator: Adam, batches of one picture of each kind, a pool of made pictures, resumable."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from hecbench.errors import InputError
from hecbench.system import files
from hecbench_plugins.perception import checkpoint
from hecbench_plugins.perception.checkpoint import Progress
from hecbench_plugins.perception.family import Family
from hecbench_plugins.perception.onnx_export import graph_of
from hecbench_plugins.perception.processor import prepared
from hecbench_plugins.translation.model import CARD, FORMAT, WEIGHTS
from hecbench_plugins.translation.networks import networks_of
from hecbench_plugins.translation.objectives import Pictures, generators_loss, judges_loss
from hecbench_plugins.translation.pictures import Pairs
from hecbench_plugins.translation.plan import Plan

CHECKPOINT = "checkpoint.safetensors"
_RATE, _BETAS = 2e-4, (0.5, 0.999)
_POOL = 50
"""Made pictures from which the discriminators are shown an older one, half of the time (Shrivastava et al. 2017)."""
_SAVE_SECONDS, _REPORT_SECONDS = 120.0, 30.0
_FIRST_PICTURES = 24


class Training:
    """A run; a folder with a checkpoint goes on where it ended."""

    def __init__(self, plan: Plan, say: Callable[[str], None]) -> None:
        self.plan, self.say = plan, say
        self.device = prepared(plan.threads, plan.seed)
        self.family = Family.of(plan.robots)
        self.nets = networks_of(plan)
        self.progress = Progress((str(plan.method), *self.family.names), plan.seed)
        tensors = self._stored()
        self.nets.to(self.device)
        self.optimiser = torch.optim.Adam(self.nets.parameters(), lr=_RATE, betas=_BETAS)
        checkpoint.load_moments(self.optimiser, self.nets, tensors)
        self.progress.history.append(str(plan))
        self.rng = np.random.default_rng((plan.seed, self.progress.step))
        self.pairs = Pairs(self.family, plan.size, (plan.seed, self.progress.step))
        self.pool: list[tuple[Tensor, Tensor]] = []

    @property
    def path(self) -> Path:
        """Of the checkpoint."""
        return self.plan.out / CHECKPOINT

    def _stored(self) -> dict[str, Tensor]:
        if not self.path.exists():
            return {}
        tensors, stored = checkpoint.read(self.path)
        if stored.robots != self.progress.robots:
            raise InputError(f"{self.path}: a run of {', '.join(stored.robots)}: give another --out")
        checkpoint.load_weights(self.nets, tensors, "weights", self.path)
        self.progress = stored
        self.say(f"{self.path}: goes on after step {stored.step}")
        return tensors

    def run(self) -> None:
        """Train until the plan's end."""
        began, before = time.monotonic(), self.progress.seconds
        saved = reported = began
        recent: list[dict[str, float]] = []
        for _ in range(_FIRST_PICTURES):
            self.pairs.draw()
        while self.progress.step < self.plan.steps:
            recent = [*recent[-99:], self._step()]
            now = time.monotonic()
            self.progress.seconds = before + now - began
            if now - reported > _REPORT_SECONDS or self.progress.step == self.plan.steps:
                reported = now
                self._report(recent)
            if now - saved > _SAVE_SECONDS:
                saved = now
                self.save()
        self.save()

    def save(self) -> None:
        """Write the checkpoint."""
        checkpoint.write(self.path, self.nets, {}, self.optimiser, self.progress)

    def _step(self) -> dict[str, float]:
        done = self.progress.step / self.plan.steps
        for group in self.optimiser.param_groups:
            group["lr"] = _RATE * min(1.0, 2 - 2 * done)
        photo, drawn = self.pairs.next()
        seen = Pictures(*(torch.from_numpy(one)[None].to(self.device) for one in (*photo, *drawn)))
        terms, made, back = generators_loss(self.nets, self.plan.method, seen)
        self._update(sum(terms.values(), torch.zeros((), device=self.device)), judges=False)
        judged = judges_loss(self.nets, self.plan.method, seen, *self._pooled(made.detach(), back.detach()))
        self._update(judged, judges=True)
        self.progress.step += 1
        self.progress.drawn += 1
        return {name: float(term.detach()) for name, term in terms.items()} | {
            "judges": float(judged.detach())
        }

    def _update(self, loss: Tensor, judges: bool) -> None:
        """One step of the networks that judge, or of all others."""
        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        for name, net in self.nets.items():
            if (name in ("drawn", "photo", "masks")) is not judges:
                for weight in net.parameters():
                    weight.grad = None
        self.optimiser.step()

    def _pooled(self, made: Tensor, back: Tensor) -> tuple[Tensor, Tensor]:
        if len(self.pool) < _POOL:
            self.pool.append((made, back))
            return made, back
        if self.rng.random() < 0.5:
            return made, back
        place = int(self.rng.integers(_POOL))
        older, self.pool[place] = self.pool[place], (made, back)
        return older

    def _report(self, recent: list[dict[str, float]]) -> None:
        means = {name: float(np.mean([row[name] for row in recent])) for name in recent[-1]}
        self.progress.curve.append([round(self.progress.seconds), self.progress.step, *means.values()])
        terms = ", ".join(f"{name} {value:.3f}" for name, value in means.items())
        self.say(
            f"{self.progress.seconds / 60:.1f} min, step {self.progress.step} of {self.plan.steps}: {terms}"
        )


def write_model(training: Training) -> Path:
    """Write `training.plan.out`/model, which OpenCV runs, and return it."""
    plan, progress = training.plan, training.progress
    folder = plan.out / "model"
    graph = graph_of(training.nets["to_drawn"], plan.size)
    files.write_bytes(folder / WEIGHTS, graph)
    card = {
        "format": FORMAT,
        "method": str(plan.method),
        "size": plan.size,
        "sha256": hashlib.sha256(graph).hexdigest(),
        "robots": list(training.family.names),
        "settings": progress.history,
        "steps": progress.step,
        "hours": round(progress.seconds / 3600, 3),
        "curve": progress.curve,
    }
    files.write_text(folder / CARD, json.dumps(card, indent=1) + "\n")
    return folder
