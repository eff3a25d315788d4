"""Second-order alignment of a rendered robot with pictures of it; the method is `hecbench_plugins.render_gn`."""

from __future__ import annotations

from collections.abc import Iterable

from hecbench.registry import hookimpl
from hecbench.specs import Need, Solver, SolverSpec


def _render_gn() -> Solver:
    from hecbench_plugins.render_gn import RenderGN

    return RenderGN()


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's solver."""
    yield SolverSpec(
        name="render_gn",
        summary="renders the robot and aligns it by Gauss-Newton: silhouette, then colours or edges",
        factory=_render_gn,
        needs=frozenset({Need.ROBOT_MODEL, Need.JOINTS, Need.INTRINSICS, Need.INITIAL}),
        reference="own; object-space edges after Loper and Black 2014 (OpenDR) and Laine et al. 2020",
        slow=True,
    )
