"""A method solved again on folds: what every evaluator of left-out samples begins with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hecbench.estimate import Estimate, Status
from hecbench.recording import Recording
from hecbench.samples.standstills import folds

FOLDS = 5


@dataclass(frozen=True, eq=False)
class SolvedFold:
    """The answer of all samples but those left out."""

    estimate: Estimate
    training: NDArray[np.int64]
    left_out: NDArray[np.int64]


def solve_folds(
    recording: Recording, usable: ArrayLike, solve: Callable[[Recording], Estimate], rng: np.random.Generator
) -> tuple[list[SolvedFold], dict[str, int]]:
    """The folds with an answer, and the counts `folds` and `failed_folds`.

    Args:
        recording: with all samples.
        usable: indices of the samples that count.
        solve: the method.
        rng: decides which samples are left out together.
    """
    parts = folds(recording, usable, FOLDS, rng)
    solved = []
    for left_out in parts:
        training = np.setdiff1d(usable, left_out)
        if len(training) and (found := solve(recording.subset(training))).status is Status.OK:
            solved.append(SolvedFold(found, training, left_out))
    return solved, {"folds": len(parts), "failed_folds": len(parts) - len(solved)}
