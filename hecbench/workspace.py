"""Where the gripper works, as points at which calibrations are compared: one definition for every ruler."""

from __future__ import annotations

import numpy as np

from hecbench.se3 import Array

CUBE_M = 0.4


def cube_corners(base_T_flange: Array) -> Array:
    """Corners (8, 3) m of a 0.4 m cube, axes of the base, centred on the mean of flange poses (N, 4, 4)."""
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
    return np.asarray(base_T_flange[:, :3, 3].mean(0) + CUBE_M / 2 * signs)
