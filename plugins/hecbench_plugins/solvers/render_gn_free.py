"""render_gn without a start: a view sphere searched by masks or by photographs (`start_search`)."""

from __future__ import annotations

from collections.abc import Iterable

from hecbench.registry import hookimpl
from hecbench.specs import Need, Solver, SolverSpec

_SPACING_DEG = 15.0
"""Of the view sphere that photographs are searched on; what they show tolerates a coarser one than masks do."""


def render_gn_free() -> Solver:
    """The solver."""
    from hecbench_plugins.fallback import MasksElsePhotographs
    from hecbench_plugins.maskless.solver import Maskless
    from hecbench_plugins.start_search.by_masks import GuessFree
    from hecbench_plugins.start_search.view_sphere import ViewSphere

    return MasksElsePhotographs(GuessFree(), Maskless(free=ViewSphere(spacing_deg=_SPACING_DEG)), Maskless())


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's method."""
    yield SolverSpec(
        name="render_gn_free",
        summary="render_gn without a start: a fixed camera searched over a view sphere by the robot's masks",
        factory=render_gn_free,
        needs=frozenset({Need.ROBOT_MODEL, Need.JOINTS, Need.INTRINSICS}),
        reference="own; hemisphere search after Hong et al. 2024 (EasyHeC++), soft-Dice swarm of roboreg",
        slow=True,
    )
