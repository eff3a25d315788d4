"""The checks that every plugin passes, ours and a stranger's: laws that hold for any correct one of its kind."""

from __future__ import annotations

from hecbench.conformance import markerless, others, solvers
from hecbench.conformance.outcome import Check, run
from hecbench.conformance.perception import check_perception
from hecbench.conformance.solvers import rig
from hecbench.errors import Refusal
from hecbench.specs import (
    AnySpec,
    DatasetSpec,
    EvaluatorSpec,
    ExporterSpec,
    PerceptionSpec,
    SegmenterSpec,
    SolverSpec,
    TranslatorSpec,
)

__all__ = ["Check", "check_plugin", "check_solver", "rig"]


def check_plugin(spec: AnySpec) -> list[Check]:
    """Run every check on a plugin.

    Raises:
        Refusal: there are no checks for plugins of this kind.
    """
    match spec:
        case SolverSpec():
            return check_solver(spec)
        case SegmenterSpec():
            return run({"masks of the robot": others.segments}, spec)
        case TranslatorSpec():
            return run({"pictures": others.translates}, spec)
        case DatasetSpec():
            return run({"what is not of the format": others.reads}, spec)
        case ExporterSpec():
            return run({"both mountings": others.exports}, spec)
        case EvaluatorSpec():
            return run({"numbers": others.evaluates}, spec)
        case PerceptionSpec():
            return check_perception(spec)
    raise Refusal(f"{spec.name}: there are no checks for a {spec.kind}")


def check_solver(spec: SolverSpec) -> list[Check]:
    """The checks of marker solvers, or those of solvers that look at the robot, by what the solver needs."""
    checks = solvers.CHECKS if spec.needs <= solvers.SUPPORTED else markerless.CHECKS
    return run(checks, spec.factory())
