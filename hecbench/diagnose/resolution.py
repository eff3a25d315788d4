"""Intrinsics as they would be for pictures of another resolution."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from hecbench.recording import CameraModel

BY_SIZE = "use the intrinsics of the resolution the images were taken at, or scale fx, fy, cx, cy"
OFF_CENTRE = 0.15
"""Of the image's size; lenses are centred to a few per cent."""
_RATIOS = (0.25, 1 / 3, 0.5, 2 / 3, 0.75, 0.8, 1.25, 4 / 3, 1.5, 2.0, 3.0, 4.0)


def rescaled(camera: CameraModel) -> Iterator[tuple[float, CameraModel]]:
    """The usual ratios of resolutions at which the principal point would be near the image's centre."""
    for ratio in _RATIOS:
        if off_centre(changed := scaled(camera, ratio)) <= OFF_CENTRE:
            yield ratio, changed


def scaled(camera: CameraModel, ratio: float) -> CameraModel:
    """The camera with fx, fy, cx and cy times a ratio."""
    K = camera.intrinsics.copy()
    K[:2] *= ratio
    return replace(camera, K=K)


def off_centre(camera: CameraModel) -> float:
    """How far the principal point is from the image's centre, over the image's size."""
    return float(np.abs(camera.intrinsics[:2, 2] / [camera.width, camera.height] - 0.5).max())
