"""The rigid motion between two sets of the same points."""

from __future__ import annotations

import numpy as np

from hecbench import se3
from hecbench.se3 import Array


def rigid_fit(points_b: Array, points_a: Array) -> tuple[Array, float]:
    """a_T_b (4, 4) that lays points (P, 3) m onto their partners, and the rms distance left (Kabsch 1976)."""
    centre_a, centre_b = points_a.mean(0), points_b.mean(0)
    turn = se3.nearest_rotation((points_a - centre_a).T @ (points_b - centre_b))
    a_T_b = se3.make(turn, centre_a - turn @ centre_b)
    left = se3.transform_points(a_T_b, points_b) - points_a
    return a_T_b, float(np.sqrt((left**2).sum(1).mean()))
