"""Masks where the robot can be distinguished from its background, else the photographs themselves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hecbench.errors import Refusal, SolverFailure
from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.se3 import Array
from hecbench.specs import Need, Solver
from hecbench_plugins.views.pyramid import NoMask, RaggedMasks


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
        found = self._by_masks(recording, rng)
        if found is None:
            return self.by_photographs(recording, rng=rng)
        if found.diagnostics.get("stage") != "coverage":
            return found
        return self._from(found.parent_T_camera, recording, rng) or found

    def _by_masks(self, recording: Recording, rng: np.random.Generator) -> Estimate | None:
        """The answer by masks, None where the photographs are to be asked instead.

        On its own: an exception that is being handled keeps the pictures of its frames in memory.
        """
        try:
            return self.by_masks(recording, rng=rng)
        except NoMask:
            return None
        except RaggedMasks as failure:
            seen = self._from(failure.parent_T_camera, recording, rng)
            if seen is None:
                raise
            return seen
        except SolverFailure:
            if Need.MASKS in recording.offers():
                raise
            return None

    def _from(
        self, parent_T_camera: Array | None, recording: Recording, rng: np.random.Generator
    ) -> Estimate | None:
        """The end by photographs from where ragged masks led, or None where they confirm nothing there."""
        if Need.IMAGES not in recording.offers():
            return None
        try:
            return self.from_start(replace(recording, initial_parent_T_camera=parent_T_camera), rng=rng)
        except (Refusal, SolverFailure):
            return None
