"""What one picture shows: the target's corners and its pose."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hecbench import preparation
from hecbench.lens import CameraModel
from hecbench.recording import ImageSource, Recording
from hecbench.se3 import Array

_FOCAL_IN_WIDTHS = 1.2
"""Of a camera whose K is not known: only where the target is seen is used then."""
_MARK_RGB = (255, 60, 60)
_WIDEST_PX = 640


@dataclass(frozen=True, eq=False)
class Seen:
    """The target in one picture.

    Attributes:
        corners_px: (P, 2), NaN where a point is hidden.
        camera_T_target: (4, 4) m, None while K is not known or the target has no pose.
    """

    corners_px: Array
    camera_T_target: Array | None


def look_for(cell: Recording, image: ImageSource) -> Seen | None:
    """The target of a cell in an image; None where it is not seen or the cell has none.

    Raises:
        InputError: The image cannot be read.
    """
    if cell.target is None:
        return None
    single = Recording(
        name=cell.name,
        mounting=cell.mounting,
        sample_ids=("now",),
        base_T_flange=np.eye(4)[None],
        camera=cell.camera,
        target=cell.target,
        images=(image,),
    )
    known = cell.camera is not None and cell.camera.K is not None
    if not known:
        height, width = single.image(0).shape[:2]
        single = replace(single, camera=CameraModel.centred(width, height, _FOCAL_IN_WIDTHS * width))
    found = preparation.prepare(single)
    if found.corners_px is None or not np.isfinite(found.corners_px).any():
        return None
    poses = found.camera_T_target
    usable = known and poses is not None and np.isfinite(poses[0]).all()
    return Seen(found.corners_px[0], poses[0] if usable and poses is not None else None)


def marked(image: NDArray[np.uint8], pixels: Array, of_width: int) -> NDArray[np.uint8]:
    """A copy of the image with pixels (P, 2) marked in squares of a share of its width; NaN are left out."""
    picture = image.copy()
    height, width = picture.shape[:2]
    reach = max(1, width // of_width)
    for u, v in pixels[np.isfinite(pixels).all(1)].round().astype(int):
        rows = slice(max(v - reach, 0), max(min(v + reach + 1, height), 0))
        picture[rows, max(u - reach, 0) : max(min(u + reach + 1, width), 0)] = _MARK_RGB
    return picture


def small(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The image at most 640 px wide, as a page shows it."""
    step = -(-image.shape[1] // _WIDEST_PX)
    return np.ascontiguousarray(image[::step, ::step])
