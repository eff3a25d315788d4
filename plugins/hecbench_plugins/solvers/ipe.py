"""IPE, Lu et al. 2023; the method is `hecbench_plugins.first_order.ipe`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from hecbench.registry import hookimpl
from hecbench.specs import Need, Option, Solver, SolverSpec
from hecbench_plugins.first_order.options import BACKEND, ITERATIONS, positive


def _ipe(**options: Any) -> Solver:
    from hecbench_plugins.first_order.ipe import IPE

    return IPE(**options)


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's method."""
    yield SolverSpec(
        name="ipe",
        summary="renders the robot's mask and lowers mask, distance and appearance losses by Adam",
        factory=_ipe,
        needs=frozenset({Need.ROBOT_MODEL, Need.JOINTS, Need.INTRINSICS, Need.INITIAL, Need.MASKS}),
        reference="Lu, Liu, Girerd and Yip 2023, ICRA",
        imports=("torch",),
        slow=True,
        options=(
            Option(
                "gamma", positive, "px that distances are divided by, half the picture's diagonal by default"
            ),
            ITERATIONS,
            BACKEND,
        ),
    )
