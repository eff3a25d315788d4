"""How precisely the samples can determine X at all, and along which direction least."""

from __future__ import annotations

import numpy as np

from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity
from hecbench.diagnose.precision import precision
from hecbench.system.wording import significant

ID = "conditioning"
LIMIT_MM = 10.0


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """The expected error in the workspace, the condition number and the weakest direction of X.

    Rotations are scaled by the distance to the target, so that both halves of the twist are lengths.
    """
    found = precision(case)
    if found is None or case.agreed is None:
        return None, case
    distance_m = abs(float(np.median(case.agreed[0].camera_T_target[:, 2, 3])))
    scale = np.repeat([distance_m, 1.0], 3)
    variances, directions = np.linalg.eigh(scale[:, None] * found.covariance() * scale)
    condition = float(np.sqrt(variances[-1] / max(variances[0], 1e-12 * variances[-1])))
    expected_mm = found.expected_mm()
    summary = (
        f"expected error in the workspace {significant(expected_mm)} mm (one sigma); weakest is "
        f"{_described(directions[:, -1])}, {condition:.0f} times as uncertain as the strongest"
    )
    if expected_mm > LIMIT_MM:
        action = "add samples with more tilt, nearer to the camera, or with a larger target"
        return Finding(ID, Severity.WARNING, summary, action, expected_mm, LIMIT_MM), case
    return Finding(ID, Severity.OK, summary, value=expected_mm, limit=LIMIT_MM), case


def _described(direction: np.ndarray) -> str:
    """The dominant parts of a unit twist (6,) in words."""
    turn, shift = direction[:3], direction[3:]
    parts = []
    if np.linalg.norm(turn) > 0.3:
        parts.append(f"turning about ({', '.join(f'{value:.1f}' for value in turn / np.linalg.norm(turn))})")
    if np.linalg.norm(shift) > 0.3:
        parts.append(
            f"shifting along ({', '.join(f'{value:.1f}' for value in shift / np.linalg.norm(shift))})"
        )
    return " with ".join(parts) + " of the parent"
