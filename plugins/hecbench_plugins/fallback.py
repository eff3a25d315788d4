"""Masks where the robot can be told from its background, else the photographs themselves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hecbench.errors import Refusal, SolverFailure
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
        from_start: photographs from a start, for what ragged masks leave open; its word counts when it has one.
    """

    by_masks: Solver
    by_photographs: Solver
    from_start: Solver

    def __call__(self, recording: Recording, *, rng: np.random.Generator) -> Estimate:
        """Calibrate by masks if possible."""
        try:
            return self._sharpened(self.by_masks(recording, rng=rng), recording, rng)
        except NoMask:
            return self.by_photographs(recording, rng=rng)
        except SolverFailure:
            if Need.MASKS in recording.offers():
                raise
            return self.by_photographs(recording, rng=rng)

    def _sharpened(self, found: Estimate, recording: Recording, rng: np.random.Generator) -> Estimate:
        """The end by masks, or by the photographs from there where the masks are not ones of sampled pixels."""
        if found.diagnostics.get("stage") != "coverage" or Need.IMAGES not in recording.offers():
            return found
        try:
            return self.from_start(replace(recording, initial_parent_T_camera=found.parent_T_camera), rng=rng)
        except (Refusal, SolverFailure):
            return found
