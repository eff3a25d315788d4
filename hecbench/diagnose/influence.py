"""Which sample the answer hangs on: how far it moves when one is left out."""

from __future__ import annotations

import numpy as np

from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity
from hecbench.diagnose.precision import precision
from hecbench.system.wording import significant

ID = "influence"
LIMIT = 3.0
"""Times the expected error: leaving out one good sample does not move the answer that far."""


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """One Gauss-Newton step without each sample, as displacement in the workspace."""
    found = precision(case)
    if found is None or case.agreed is None or len(found.gradients) < 5:
        return None, case
    without = found.information.sum(0) - found.information
    steps = np.linalg.solve(without, found.gradients[..., None])[:, :6, 0]
    moved_mm = found.displacement_mm(steps)
    worst = int(moved_mm.argmax())
    ids = case.ids(case.agreed[1])
    concerned, each = (ids[worst],), dict(zip(ids, moved_mm.tolist(), strict=True))
    value, limit = float(moved_mm[worst]), LIMIT * found.expected_mm()
    moves = f"moves by {significant(value)} mm in the workspace, the most of all"
    summary = f"without sample {concerned[0]} the answer {moves}"
    if value > limit:
        action = "record more samples like this one, or look whether it is right"
        return Finding(ID, Severity.WARNING, summary, action, value, limit, concerned, each), case
    return Finding(ID, Severity.OK, summary, "", value, limit, concerned, each), case
