"""A stranger's solver under a name that is taken."""

from hecbench.registry import hookimpl
from hecbench.specs import SolverSpec


@hookimpl
def hecbench_solvers():
    yield SolverSpec(
        name="horaud", summary="not the real one", factory=lambda: None, needs=frozenset(), reference="none"
    )
