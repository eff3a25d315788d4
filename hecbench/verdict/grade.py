"""The grade in one word, with the rule that gave it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hecbench.verdict.result import Expected, Grade

USELESS = 4.0
"""Tolerances: an answer that is expected to be farther off says nothing to its user."""
NOT_FAULTS = frozenset(
    {"rotation_diversity", "coverage", "conditioning", "image_quality", "influence", "next_pose"}
)
"""Findings whose warning is about how much the data say; the warning of any other is about whether they are right."""


def graded(
    expected: Expected | None,
    tolerance_mm: float,
    findings: Sequence[dict[str, Any]],
    doubts: Sequence[str],
    *,
    is_checked: bool,
) -> tuple[Grade, str]:
    """The grade and its rule.

    Args:
        expected: error of the recommended answer; None where nothing is known of it.
        tolerance_mm: of the user.
        findings: of `check`, as JSON.
        doubts: what contradicts the answer.
        is_checked: whether `check` or another sensor could have found a fault.
    """
    critical = [finding["id"] for finding in findings if finding["severity"] == "critical"]
    warnings = [finding["id"] for finding in findings if finding["severity"] == "warning"]
    faults = [name for name in warnings if name not in NOT_FAULTS]
    if critical:
        return Grade.DO_NOT_USE, f"critical findings: {', '.join(critical)}"
    if expected is None:
        return (Grade.DO_NOT_USE, doubts[0]) if doubts else (Grade.DOUBTFUL, "its error cannot be estimated")
    if expected.value > USELESS * tolerance_mm:
        return Grade.DO_NOT_USE, f"the expected error is more than {USELESS:g} x {tolerance_mm:g} mm"
    if doubts or faults:
        return Grade.DOUBTFUL, doubts[0] if doubts else f"findings: {', '.join(faults)}"
    if expected.value > tolerance_mm:
        return Grade.DOUBTFUL, f"the expected error is more than {tolerance_mm:g} mm"
    if expected.high > tolerance_mm:
        return Grade.USABLE, f"the expected error is within {tolerance_mm:g} mm, its interval is not"
    if warnings:
        return Grade.USABLE, f"within {tolerance_mm:g} mm, with findings: {', '.join(warnings)}"
    if not is_checked:
        return Grade.USABLE, f"within {tolerance_mm:g} mm, but nothing independent confirms it"
    return (
        Grade.GOOD,
        f"the interval of the expected error is within {tolerance_mm:g} mm and nothing contradicts it",
    )
