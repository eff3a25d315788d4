"""The checks that every plugin passes, ours and a stranger's."""

from hecbench.conformance.solvers import Check, check_solver, rig

__all__ = ["Check", "check_solver", "rig"]
