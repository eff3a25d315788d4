"""EasyHeC, Chen et al. 2023; the method is `hecbench_plugins.first_order.easyhec`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from hecbench.registry import hookimpl
from hecbench.specs import Need, Solver, SolverSpec
from hecbench_plugins.first_order.options import BACKEND, ITERATIONS, MASKS


def _easyhec(**options: Any) -> Solver:
    from hecbench_plugins.first_order.easyhec import EasyHeC

    return EasyHeC(**options)


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's method."""
    yield SolverSpec(
        name="easyhec",
        summary="renders the robot's mask and lowers its squared error by Adam on the se(3) logarithm",
        factory=_easyhec,
        needs=frozenset({Need.ROBOT_MODEL, Need.JOINTS, Need.INTRINSICS, Need.INITIAL, Need.MASKS}),
        reference="Chen et al. 2023, doi 10.1109/LRA.2023.3315551",
        imports=("torch",),
        slow=True,
        options=(MASKS, ITERATIONS, BACKEND),
    )
