"""Findings on a recording before anything is solved: one file per kind of fault."""

from hecbench.diagnose.checks import check
from hecbench.diagnose.finding import Finding, Severity

__all__ = ["Finding", "Severity", "check"]
