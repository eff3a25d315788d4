"""What the compiled loops over the contour read and write."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hecbench.rendering import Renderer, RenderMesh
from hecbench.se3 import Array
from hecbench_plugins.maskless import contour_kernels


class ContourPoints(NamedTuple):
    """Room for n points of a drawn contour, and where their images show them."""

    place: Array
    """(n, 4): x, y px and the outward normal."""
    normal_rate: Array
    """(n, 3) px/m along the outward normal by the motion of the point in the camera frame."""
    parts: NDArray[np.int32]
    """(n, 2) inside and outside, -1 = background."""
    kept: NDArray[np.int32]
    """(n,) which of the renderer's crossings it is."""
    mean: Array
    """(n,) px along the outward normal."""
    variance: Array
    """(n,) px^2, -1 where the image has no say."""

    @classmethod
    def of(cls, room: int) -> ContourPoints:
        """For so many points."""
        return cls(
            np.zeros((room, 4)),
            np.zeros((room, 3)),
            np.zeros((room, 2), np.int32),
            np.zeros(room, np.int32),
            np.zeros(room),
            np.zeros(room),
        )


class KnownColours(NamedTuple):
    """The colours of the parts and of what is around them."""

    inside: NDArray[np.float32]
    """(P, BINS^3) log densities, as `around`."""
    around: NDArray[np.float32]
    mean_around: NDArray[np.float32]
    """(BINS^3,) density."""


class KnownScene(NamedTuple):
    """What is known of the pictures beside the robot; without a known background it and its agreement have no rows."""

    valid: NDArray[np.bool_]
    """(H, W) where the pictures say something."""
    background: NDArray[np.uint8]
    """(H, W, 3) RGB."""
    agreement: NDArray[np.float32]
    """(H, W) share of the views that show it."""
    covered: NDArray[np.int16]
    """(H, W) how many views the robot covered in when it was drawn last."""
    views: int


class Buffers:
    """What one thread writes into."""

    def __init__(self, mesh: RenderMesh, K: Array, width: int, height: int) -> None:
        self.renderer = Renderer(mesh, K, width, height)
        histograms = (len(mesh.part_names), contour_kernels.BINS**3)
        self.inside, self.around = (np.zeros(histograms, np.float32) for _ in range(2))
        self.covered = np.zeros((height, width), np.int16)
        self.image, self.smooth = (np.zeros((height, width, 3), np.uint8) for _ in range(2))
        self.points = ContourPoints.of(16 * (width + height) + 32768)
