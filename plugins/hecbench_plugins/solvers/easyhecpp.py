"""EasyHeC++, Zheng et al. 2024; the method is `hecbench_plugins.first_order.easyhec`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from hecbench.registry import hookimpl
from hecbench.specs import Need, Solver, SolverSpec
from hecbench_plugins.first_order.options import BACKEND, ITERATIONS, MASKS


def _easyhecpp(**options: Any) -> Solver:
    from hecbench_plugins.first_order.easyhec import EasyHeC

    return EasyHeC(search_start=True, **options)


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's method."""
    yield SolverSpec(
        name="easyhecpp",
        summary="like easyhec, from the best mask overlap of cameras on a hemisphere: needs no start",
        factory=_easyhecpp,
        needs=frozenset({Need.ROBOT_MODEL, Need.JOINTS, Need.INTRINSICS, Need.MASKS}),
        reference="Zheng et al. 2024, EasyHeC++, IROS",
        imports=("torch",),
        slow=True,
        options=(MASKS, ITERATIONS, BACKEND),
    )
