"""What a frame leads to."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from hecbench.se3 import Array


class Verdict(StrEnum):
    """What a frame leads to."""

    LEARNING = "learning"
    TRUE = "true"
    CANNOT_SEE = "cannot_see"
    MOVED = "moved"


@dataclass(frozen=True, eq=False)
class WatchState:
    """The state after a frame.

    Attributes:
        verdict: what it leads to.
        frame: how many there were before.
        confirmed: share of the robot's contour that this frame confirms.
        score: mean square of the six standardised offsets of the window; None while nothing is concluded.
        offset_mm: rms displacement of the workspace against the estimate; None while nothing is concluded.
        parent_T_camera: (4, 4) m, the camera by the window's frames; the estimate's before there are any.
        covariance: (6, 6) of it, as an estimate's, or None.
        reason: of an alarm or of not seeing, a sentence; else None.
    """

    verdict: Verdict
    frame: int
    confirmed: float
    score: float | None
    offset_mm: float | None
    parent_T_camera: Array
    covariance: Array | None
    reason: str | None = None

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "frame": self.frame,
            "verdict": str(self.verdict),
            "confirmed": round(self.confirmed, 3),
            "score": None if self.score is None else round(self.score, 2),
            "offset_mm": None if self.offset_mm is None else round(self.offset_mm, 2),
            "parent_T_camera": self.parent_T_camera.tolist(),
            "covariance": None if self.covariance is None else self.covariance.tolist(),
            "reason": self.reason,
        }
