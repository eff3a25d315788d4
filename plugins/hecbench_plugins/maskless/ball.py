"""A region of camera poses around a start."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hecbench import se3
from hecbench.se3 import Array


@dataclass(frozen=True)
class Ball:
    """How far off the start may be: the camera's centre, m, and its rotation, rad."""

    centre_m: float
    turn_rad: float

    def __str__(self) -> str:
        return f"{self.centre_m:g} m and {np.rad2deg(self.turn_rad):.0f} deg"

    @property
    def scale(self) -> Array:
        """(6,) of the coordinates of a pose in the ball."""
        return np.array([self.centre_m] * 3 + [self.turn_rad] * 3)

    def pose(self, start: Array, x: Array) -> Array:
        """parent_T_camera (..., 4, 4) whose centre is moved by x[..., :3] m in the parent's frame and that is turned by
        the rotation vector x[..., 3:] rad in its own.
        """
        return se3.make(start[:3, :3] @ se3.so3_exp(x[..., 3:]), start[:3, 3] + x[..., :3])

    def away(self, start: Array, pose: Array) -> tuple[float, float]:
        """Distance and turn of a pose from the start, in radii."""
        return (
            float(se3.translation_error_m(start, pose)) / self.centre_m,
            float(se3.rotation_error_rad(start, pose)) / self.turn_rad,
        )

    def draw(self, rng: np.random.Generator, count: int) -> Array:
        """(count, 6) coordinates drawn in the ball and a tenth beyond."""
        directions = rng.normal(size=(count, 2, 3))
        directions /= np.linalg.norm(directions, axis=2, keepdims=True)
        radii = 1.1 * np.sqrt(rng.random((count, 2, 1)))
        return np.asarray((directions * radii).reshape(count, 6) * self.scale)
