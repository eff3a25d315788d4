"""Jin, Yu, Chen, Li 2024, "Hand-eye parameter estimation based on 3D observation of a single marker" (TIM):
the closed form.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from hecbench.errors import Refusal
from hecbench.estimate import Estimate, Termination
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import Need, SolverSpec
from hecbench_plugins.markers import single3d

MINIMUM_SAMPLES = 5


@dataclass(frozen=True)
class Single3DClosed:
    """One linear system for the nine entries of R, then the nearest rotation, then t and the marker.

    Attributes:
        reference_projection: project as the authors' code does, by the sign of the determinant.
    """

    reference_projection: bool = False

    def __call__(self, recording: Recording, *, rng: np.random.Generator) -> Estimate:
        """Answer.

        Raises:
            Refusal: fewer than 5 samples, or no rotation about a second axis.
        """
        positions = single3d.marker_positions(recording)
        if len(positions.hand) < MINIMUM_SAMPLES:
            raise Refusal(
                f"{len(positions.hand)} samples; the nine linear unknowns need {MINIMUM_SAMPLES} or more"
            )
        rotation = single3d.closed_form(positions, reference_projection=self.reference_projection)
        return single3d.to_estimate(positions, rotation, Termination.CLOSED_FORM)


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's solver."""
    yield SolverSpec(
        name="single3d_closed",
        summary="positions of one marker, linear",
        factory=Single3DClosed,
        needs=frozenset({Need.TARGET_POSES}),
        reference="Jin, Yu, Chen, Li 2024, IEEE TIM",
    )
