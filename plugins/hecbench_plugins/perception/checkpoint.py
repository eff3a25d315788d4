"""The state of a training run in one safetensors file: what a killed run goes on from."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import Tensor, nn

from hecbench.errors import InputError
from hecbench.system import files


@dataclass
class Progress:
    """How far a run has come. `curve` has a row of seconds, steps and mean losses for every report."""

    robots: tuple[str, ...]
    seed: int
    step: int = 0
    seconds: float = 0.0
    drawn: int = 0
    averaged: int = 0
    curve: list[list[float]] = field(default_factory=list)
    history: list[str] = field(default_factory=list)
    """Its settings, one line whenever they changed."""


def write(path: Path, net: nn.Module, average: dict[str, Tensor], optimiser: Any, progress: Progress) -> None:
    """Write weights, their running mean and the optimiser's moments; the file is whole or as it was."""
    tensors = {f"weights/{name}": value.contiguous() for name, value in net.state_dict().items()}
    tensors |= {f"average/{name}": value.contiguous() for name, value in average.items()}
    for name, weight in net.named_parameters():
        for moment, value in optimiser.state.get(weight, {}).items():
            tensors[f"{moment}/{name}"] = value.contiguous()
    content = save(tensors, {"progress": json.dumps(asdict(progress))})
    files.write_bytes(path, content)


def read(path: Path) -> tuple[dict[str, Tensor], Progress]:
    """The tensors and the progress of a run.

    Raises:
        InputError: the file is missing or is no checkpoint.
    """
    content = files.read_bytes(path)
    try:
        tensors = load(content)
        header = json.loads(content[8 : 8 + int.from_bytes(content[:8], "little")])
        stored = json.loads(header["__metadata__"]["progress"])
        progress = Progress(**{**stored, "robots": tuple(stored["robots"])})
    except (SafetensorError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{path}: not a checkpoint of this training ({error}); delete it or give another"
        ) from None
    return tensors, progress


def load_weights(net: nn.Module, tensors: dict[str, Tensor], prefix: str, path: Path) -> None:
    """Put the tensors named ``prefix/...`` into a network.

    Raises:
        InputError: they are those of another network.
    """
    found = {
        name[len(prefix) + 1 :]: value for name, value in tensors.items() if name.startswith(f"{prefix}/")
    }
    try:
        net.load_state_dict(found)
    except RuntimeError as error:
        reason = str(error).splitlines()[-1].strip()
        raise InputError(f"{path}: weights of another network: {reason}") from None


def load_moments(optimiser: Any, net: nn.Module, tensors: dict[str, Tensor]) -> None:
    """Put the optimiser's moments back, laid out in memory as the weights are: the fused step assumes that."""
    for name, weight in net.named_parameters():
        moments = {
            moment: tensors[f"{moment}/{name}"]
            for moment in ("step", "exp_avg", "exp_avg_sq")
            if f"{moment}/{name}" in tensors
        }
        if moments:
            optimiser.state[weight] = {
                k: v if k == "step" else torch.empty_like(weight).copy_(v) for k, v in moments.items()
            }


def averaged(net: nn.Module) -> dict[str, Tensor]:
    """A copy of a network's state, to become a running mean."""
    return {name: value.detach().clone().float() for name, value in net.state_dict().items()}


def follow(average: dict[str, Tensor], net: nn.Module, keep: float) -> None:
    """Move a running mean towards the network's present state."""
    with torch.no_grad():
        for name, value in net.state_dict().items():
            average[name].lerp_(value.float(), 1 - keep)
