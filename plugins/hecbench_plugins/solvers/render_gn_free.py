"""render_gn from nothing but masks, without a start; the search is `hecbench_plugins.guess_free`."""

from __future__ import annotations

from collections.abc import Iterable

from hecbench.registry import hookimpl
from hecbench.specs import Need, Solver, SolverSpec


def _guess_free() -> Solver:
    from hecbench_plugins.guess_free import GuessFree

    return GuessFree()


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's method."""
    yield SolverSpec(
        name="render_gn_free",
        summary="render_gn without a start: a fixed camera searched over a view sphere by the robot's masks",
        factory=_guess_free,
        needs=frozenset({Need.ROBOT_MODEL, Need.JOINTS, Need.INTRINSICS}),
        reference="own; hemisphere search after Hong et al. 2024 (EasyHeC++), soft-Dice swarm of roboreg",
        slow=True,
    )
