"""What follows from an estimate."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

import numpy as np

from hecbench.specs.base import Kind, Spec

if TYPE_CHECKING:
    from hecbench.estimate import Estimate
    from hecbench.recording import Recording


class Evaluator(Protocol):
    """An evaluator. `solve` calibrates another recording with the same method, for evaluators that refit on folds."""

    def __call__(
        self,
        estimate: Estimate,
        recording: Recording,
        *,
        solve: Callable[[Recording], Estimate],
        rng: np.random.Generator,
    ) -> Mapping[str, Any]: ...


class ResultSection(StrEnum):
    """Where an evaluator's numbers go, and when it is applied."""

    ERRORS = "errors"
    """It reads the truth, and is applied where there is one."""
    HELD_OUT = "held_out"
    """It solves again on folds, and is applied without truth or when asked for."""
    DIAGNOSTICS = "diagnostics"
    """It only needs the estimate and its recording, and is always applied."""


@dataclass(frozen=True, kw_only=True)
class EvaluatorSpec(Spec):
    """An evaluator; its numbers go into the part of the estimate that `into` names."""

    kind: ClassVar[Kind] = Kind.EVALUATOR
    factory: Callable[[], Evaluator]
    into: ResultSection
    applies: Callable[[Recording], bool]


@dataclass(frozen=True, kw_only=True)
class ExporterSpec(Spec):
    """A writer. `write(estimate, options)` returns the text; `options` come from the command line."""

    kind: ClassVar[Kind] = Kind.EXPORTER
    suffix: str
    write: Callable[[Estimate, Mapping[str, str]], str]
