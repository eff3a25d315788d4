"""From a point of the picture to a point of the base, with the error to expect there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hecbench import lens, se3
from hecbench.errors import InputError
from hecbench.estimate import Estimate
from hecbench.lens import CameraModel
from hecbench.se3 import Array
from hecbench.verdict.result import Expected
from hecbench.verdict.uncertainty import uncertainty

_LEAST_DESCENT = 1e-3
"""Of a ray's direction across a plane: one that runs along it meets it nowhere that is known."""


@dataclass(frozen=True, eq=False)
class Pointed:
    """A point (3,) m of the base, with the expected error of the calibration there; None where it is not known."""

    base_m: Array
    expected: Expected | None

    def __str__(self) -> str:
        x, y, z = self.base_m
        error = "error not known" if self.expected is None else f"expected error {self.expected} (95 %)"
        return f"base x {x:.4f}, y {y:.4f}, z {z:.4f} m; {error}"


@dataclass(frozen=True, eq=False)
class Pointer:
    """A calibrated camera that points.

    Attributes:
        estimate: with an answer.
        camera: its optics, K known.
        samples: that the estimate used.
    """

    estimate: Estimate
    camera: CameraModel
    samples: int

    def at(self, pixel: Array, base_T_parent: Array, height_m: float) -> Pointed:
        """Where the ray of a pixel (2,) meets the horizontal plane `height_m` above the base.

        Raises:
            InputError: The lens does not show that pixel, or the ray does not meet the plane in front of the camera.
        """
        ideal = lens.normalised(self.camera, np.asarray(pixel, float))
        if not np.isfinite(ideal).all():
            raise InputError(
                f"pixel {_spelled(pixel)}: the lens model has no ray for it; click nearer to the middle"
            )
        base_T_camera = base_T_parent @ self.estimate.pose
        centre, ray = base_T_camera[:3, 3], base_T_camera[:3, :3] @ [*ideal, 1.0]
        along = (height_m - centre[2]) / ray[2] if abs(ray[2]) > _LEAST_DESCENT else -1.0
        if along <= 0:
            raise InputError(
                f"pixel {_spelled(pixel)}: its ray does not meet the plane at z = {height_m:g} m; click lower, or give"
                " another height"
            )
        point = centre + along * ray
        in_parent = se3.transform_points(se3.inverse(base_T_parent), point).reshape(1, 3)
        found = uncertainty(self.estimate, self.samples, in_parent)
        return Pointed(point, None if found is None else found.expected(in_parent))


def _spelled(pixel: Array) -> str:
    return f"{pixel[0]:.0f},{pixel[1]:.0f}"
