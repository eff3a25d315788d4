"""Jin, Yu, Chen, Li 2024, "Hand-eye parameter estimation based on 3D observation of a single marker" (TIM):
the iteration.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from hecbench.estimate import Estimate, Termination
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import Need, SolverSpec
from hecbench_plugins.markers import single3d


def single3d_iterative(recording: Recording, *, rng: np.random.Generator) -> Estimate:
    """Gauss-Newton over the rotation alone (variable projection), started from the closed form."""
    positions = single3d.marker_positions(recording)
    rotation, iterations = single3d.iterate(positions)
    return single3d.to_estimate(positions, rotation, Termination.CONVERGED, iterations)


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's solver."""
    yield SolverSpec(
        name="single3d_iterative",
        summary="positions of one marker, least squares over SO(3)",
        factory=lambda: single3d_iterative,
        needs=frozenset({Need.TARGET_POSES}),
        reference="Jin, Yu, Chen, Li 2024, IEEE TIM",
    )
