"""DRHeC with all its losses, and with the losses RGB and RGBC alone; the method is `first_order.drhec`."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import Any

from hecbench.registry import hookimpl
from hecbench.specs import Need, Option, Solver, SolverSpec
from hecbench_plugins.first_order.options import BACKEND, ITERATIONS, choice, not_negative

_METHODS = {
    "drhec_rgb": ("rgb", "its colours"),
    "drhec_rgbc": ("rgbc", "its colours, and first its centroid"),
    "drhec": ("full", "its colours, and first its centroid and area"),
}


def _drhec(losses: str, **options: Any) -> Solver:
    from hecbench_plugins.first_order.drhec import DRHeC, Losses, Variant

    if "variant" in options:
        options["variant"] = Variant(options["variant"])
    return DRHeC(Losses(losses), **options)


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """The three sets of losses."""
    weights = (
        Option("lambda_cen", not_negative, "weight of the centroid's loss, 0.01 by default"),
        Option(
            "threshold",
            not_negative,
            "px of the centroid's loss at which the fine stage begins, 0.25 by default",
        ),
    )
    for name, (losses, compared) in _METHODS.items():
        chosen: tuple[Option, ...] = () if losses == "rgb" else weights
        if losses == "full":
            chosen += (Option("lambda_area", not_negative, "weight of the area's loss, 1e-4 by default"),)
        yield SolverSpec(
            name=name,
            summary=f"renders the robot and lowers the error of {compared}, by Adam",
            factory=partial(_drhec, losses),
            needs=frozenset({Need.ROBOT_MODEL, Need.JOINTS, Need.INTRINSICS, Need.INITIAL, Need.IMAGES}),
            reference="DRHeC, Algorithm 1",
            imports=("torch",),
            slow=True,
            options=(
                Option(
                    "variant", choice("literal", "resolved"), "resolved, or literal: Algorithm 1 as printed"
                ),
                *chosen,
                Option("translator", str, "plugin that makes pictures look simulated, identity by default"),
                ITERATIONS,
                BACKEND,
            ),
        )
