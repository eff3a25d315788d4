"""The network for UR5e and UR3e; its model card is in `weights_ur/`."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from hecbench.registry import hookimpl
from hecbench.specs import Perceiver, PerceptionSpec

WEIGHTS = Path(__file__).parent / "weights_ur"


def load() -> Perceiver:
    """The network, ready to run."""
    from hecbench_plugins.perception.model import PerceptionModel

    return PerceptionModel(WEIGHTS)


@hookimpl
def hecbench_perception() -> Iterable[PerceptionSpec]:
    """This file's network."""
    yield PerceptionSpec(
        name="ur",
        summary="finds a UR5e or UR3e: its mask, its colours, ten points of its skeleton",
        robots=("ur5e", "ur3e"),
        factory=load,
    )
