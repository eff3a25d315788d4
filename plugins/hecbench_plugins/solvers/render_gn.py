"""Second-order alignment of a rendered robot with pictures of it; the method is `hecbench_plugins.render_gn`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import partial

from hecbench.registry import hookimpl
from hecbench.specs import Need, Solver, SolverSpec

_ALSO_SOLVED = {
    "joints": "the offset of every joint",
    "scale": "the robot's scale",
    "focal": "the focal length",
}


def _render_gn(*unknown: str) -> Solver:
    from hecbench_plugins.render_gn import RenderGN
    from hecbench_plugins.render_unknowns import Unknown

    return RenderGN(unknown=tuple(Unknown(name) for name in unknown))


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """The method alone, and with each of the other unknowns that it can solve for."""
    common = SolverSpec(
        name="render_gn",
        summary="renders the robot and aligns it by Gauss-Newton: silhouette, then colours or edges",
        factory=_render_gn,
        needs=frozenset({Need.ROBOT_MODEL, Need.JOINTS, Need.INTRINSICS, Need.INITIAL}),
        reference="own; object-space edges after Loper and Black 2014 (OpenDR) and Laine et al. 2020",
        slow=True,
    )
    yield common
    for unknown, what in _ALSO_SOLVED.items():
        yield replace(
            common,
            name=f"render_gn_{unknown}",
            summary=f"like render_gn, with {what} unknown too, within a prior",
            factory=partial(_render_gn, unknown),
        )
