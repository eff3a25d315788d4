"""Second-order alignment of a rendered robot with pictures of it, with masks or without them."""

from __future__ import annotations

from collections.abc import Iterable

from hecbench.registry import hookimpl
from hecbench.specs import Need, Option, Solver, SolverSpec


def render_gn(unknown: tuple[str, ...] = ()) -> Solver:
    """The solver that also solves for what `unknown` names."""
    from hecbench_plugins.fallback import MasksElsePhotographs
    from hecbench_plugins.maskless.solver import Maskless
    from hecbench_plugins.second_order.render_gn import RenderGN
    from hecbench_plugins.second_order.unknowns import Unknown

    wanted = tuple(Unknown(name) for name in unknown)
    photographs = Maskless(unknown=wanted)
    return MasksElsePhotographs(RenderGN(unknown=wanted), photographs, photographs)


def _unknowns(text: str) -> tuple[str, ...]:
    names = tuple(text.split("+"))
    for name in names:
        if name not in ("joints", "scale", "focal"):
            raise ValueError(f"'{name}' is none of joints, scale, focal")
    return names


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's method."""
    yield SolverSpec(
        name="render_gn",
        summary="renders the robot and aligns it by Gauss-Newton: silhouette, then colours or edges",
        factory=render_gn,
        needs=frozenset({Need.ROBOT_MODEL, Need.JOINTS, Need.INTRINSICS, Need.INITIAL}),
        reference="own; object-space edges after Loper and Black 2014 (OpenDR) and Laine et al. 2020",
        slow=True,
        options=(
            Option(
                "unknown",
                _unknowns,
                "solved for too, within a prior: joints, scale, focal, or several with +",
            ),
        ),
    )
