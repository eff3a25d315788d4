"""Masks where the robot can be told from its background, else the photographs themselves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hecbench.errors import SolverFailure
from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.specs import Need, Solver
from hecbench_plugins.views.pyramid import NoMask


@dataclass(frozen=True)
class MasksElsePhotographs:
    """One solver of two.

    Attributes:
        by_masks: for given masks, or those that a uniform background gives.
        by_photographs: where there are none of either, or where none were given and `by_masks` fails.
    """

    by_masks: Solver
    by_photographs: Solver

    def __call__(self, recording: Recording, *, rng: np.random.Generator) -> Estimate:
        """Calibrate by masks if possible."""
        try:
            return self.by_masks(recording, rng=rng)
        except NoMask:
            return self.by_photographs(recording, rng=rng)
        except SolverFailure:
            if Need.MASKS in recording.offers():
                raise
            return self.by_photographs(recording, rng=rng)
