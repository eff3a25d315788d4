"""Starts about a start."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hecbench import se3
from hecbench.se3 import Array


@dataclass(frozen=True)
class Uncertainty:
    """How far off a start may be: its camera centre, and its rotation."""

    centre_m: float = 0.1
    rotation_deg: float = 10.0
    draws: int = 30

    def around(self, start: Array) -> list[Array]:
        """The start, then others (4, 4) exactly that far off in random directions, the same at every call."""
        rng = np.random.default_rng(0)
        found = [start]
        for _ in range(self.draws):
            axis, way = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
            turned = start[:3, :3] @ se3.so3_exp(np.deg2rad(self.rotation_deg) * axis)
            found.append(se3.make(turned, start[:3, 3] + self.centre_m * way))
        return found
