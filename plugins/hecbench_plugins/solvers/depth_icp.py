"""The rendered robot against depth pictures; the method is `hecbench_plugins.depth.solver`."""

from __future__ import annotations

from collections.abc import Iterable

from hecbench.registry import hookimpl
from hecbench.specs import Need, Option, Solver, SolverSpec


def depth_icp(silhouette: bool = False) -> Solver:
    """The solver, with the masks' contours in the last steps if wanted."""
    from hecbench_plugins.depth.solver import DepthIcp

    return DepthIcp(silhouette)


def _yes_or_no(text: str) -> bool:
    if text not in ("true", "false"):
        raise ValueError("write true or false")
    return text == "true"


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's method."""
    yield SolverSpec(
        name="depth_icp",
        summary="aligns the rendered robot with depth pictures, point to plane; needs no start for a fixed camera",
        factory=depth_icp,
        needs=frozenset({Need.ROBOT_MODEL, Need.JOINTS, Need.INTRINSICS, Need.DEPTH}),
        reference="own; projective point-to-plane after Chen and Medioni 1992, as roboreg (Huber et al. 2025)",
        slow=True,
        options=(Option("silhouette", _yes_or_no, "true uses the masks' contours too, in the last steps"),),
    )
