"""Methods, and the recordings that feed them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Protocol

import numpy as np

from hecbench.recording import Need
from hecbench.specs.base import ConfigurableSpec, Kind, Spec

if TYPE_CHECKING:
    from hecbench.estimate import Estimate
    from hecbench.recording import Recording


class Solver(Protocol):
    """A calibration method: a recording without its truth goes in, an estimate with evidence comes out."""

    def __call__(self, recording: Recording, *, rng: np.random.Generator) -> Estimate:
        """Answer, or raise `Refusal` (cannot on this recording) or `SolverFailure` (tried, and failed)."""
        ...


@dataclass(frozen=True, kw_only=True)
class SolverSpec(ConfigurableSpec):
    """A calibration method. `factory()` imports what is heavy and returns the `Solver`."""

    kind: ClassVar[Kind] = Kind.SOLVER
    factory: Callable[..., Solver]
    needs: frozenset[Need]
    reference: str
    slow: bool = False
    """Folds of the held-out evaluator run only when asked for (renderer methods)."""


@dataclass(frozen=True, kw_only=True)
class DatasetSpec(Spec):
    """A reader of one format. `sniff(path)` is quick and never raises; `load(path)` decodes no image.

    A `last_resort` is asked when no other format recognises the path; it may decode images to prove a convention.
    """

    kind: ClassVar[Kind] = Kind.DATASET
    sniff: Callable[[Path], bool]
    load: Callable[[Path], Recording]
    last_resort: bool = False


@dataclass(frozen=True, kw_only=True)
class SuiteSpec(Spec):
    """Generated recordings. `make(level, index, seed)` depends on nothing else: items stream in any order.

    `solvers(level)` names those that a level is meant for; without it all take part that its recordings can feed.
    `facts(level, index, seed)` tells numbers about an item that no solver sees and reports show.
    """

    kind: ClassVar[Kind] = Kind.SUITE
    levels: tuple[str, ...]
    default_samples: int
    make: Callable[[str, int, int], Recording]
    solvers: Callable[[str], tuple[str, ...]] = lambda level: ()
    facts: Callable[[str, int, int], Mapping[str, float]] = lambda level, index, seed: {}


@dataclass(frozen=True, kw_only=True)
class ObserverSpec(Spec):
    """An observation computed from a rawer one, before any solver runs and once for all of them.

    `factory()` returns a function recording -> recording that fills what `gives` names; it may raise
    `Refusal`.
    """

    kind: ClassVar[Kind] = Kind.OBSERVER
    gives: Need
    applies: Callable[[Recording], bool]
    factory: Callable[[], Callable[[Recording], Recording]]
