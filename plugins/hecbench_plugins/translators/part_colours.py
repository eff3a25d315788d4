"""Translation without training: every part's gain and offset, found at the current pose, are taken back.

Where the robot is drawn at the current pose, the median colour m of a part is compared with its nominal colour c,
m = gain c + offset with one gain and one offset per part. Both are held to the picture's overall gain and to zero by
a weak prior, which decides where a part of one grey cannot tell them apart. The picture is then (I - offset) / gain,
with the part of the nearest drawn pixel where none is drawn. A pixel of another part than the one drawn there keeps
its difference, so that a wrong pose is not translated into a right one.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import TranslatorSpec

Picture = NDArray[np.float32]

_FEWEST_PIXELS = 30
_GAIN_PRIOR, _OFFSET_PRIOR = 1e-3, 1e-1
"""Weights beside the squared misfit of one part's mean channel; the offset's is larger: light is mostly a gain."""
_LEAST_GAIN = 0.1


def part_colours(
    image: Picture, mask: Picture, *, part: NDArray[np.int32], colours: NDArray[np.float64]
) -> Picture:
    """The image in the parts' nominal colours, black where the mask is 0; without a drawn robot as it is."""
    drawn = part >= 0
    if not drawn.any():
        return np.asarray(image * mask[..., None], np.float32)
    gain, offset = _light(image, _pure(part) & (mask > 0.5), part, np.asarray(colours, float))
    nearest = _nearest(part)
    translated = (image - offset[nearest, None]) / gain[nearest, None]
    return np.asarray(np.clip(translated, 0, 1) * mask[..., None], np.float32)


def _pure(part: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Pixels whose four neighbours show the same part."""
    pure = part >= 0
    for axis in (0, 1):
        for step in (-1, 1):
            pure &= np.roll(part, step, axis) == part
    return pure


def _light(
    image: Picture, use: NDArray[np.bool_], part: NDArray[np.int32], colours: Array
) -> tuple[Array, Array]:
    """Gain (P,) and offset (P,) of every part; one that is hardly seen gets the overall gain."""
    labels, values = part[use], image[use].astype(float)
    seen = [k for k in np.unique(labels).tolist() if (labels == k).sum() >= _FEWEST_PIXELS]
    medians = {k: np.median(values[labels == k], 0) for k in seen}
    pixels = {k: int((labels == k).sum()) for k in seen}
    power = sum(pixels[k] * float(colours[k] @ colours[k]) for k in seen)
    overall = sum(pixels[k] * float(medians[k] @ colours[k]) for k in seen) / power if power > 0 else 1.0
    overall = max(overall, _LEAST_GAIN)
    gain, offset = np.full(len(colours), overall), np.zeros(len(colours))
    for k in seen:
        design = np.stack([colours[k], np.ones(3)], 1)
        A = design.T @ design / 3 + np.diag([_GAIN_PRIOR, _OFFSET_PRIOR])
        b = design.T @ medians[k] / 3 + [_GAIN_PRIOR * overall, 0.0]
        gain[k], offset[k] = np.linalg.solve(A, b)
    return np.maximum(gain, _LEAST_GAIN), offset


def _nearest(part: NDArray[np.int32]) -> NDArray[np.int32]:
    """The part (H, W) of the nearest pixel that shows one."""
    import cv2

    drawn = part >= 0
    _, labels = cv2.distanceTransformWithLabels(
        (~drawn).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    by_label = np.zeros(int(labels.max()) + 1, np.int32)
    by_label[labels[drawn]] = part[drawn]
    return np.asarray(by_label[labels])


@hookimpl
def hecbench_translators() -> Iterable[TranslatorSpec]:
    """This file's method."""
    yield TranslatorSpec(
        name="part_colours",
        summary="without training: takes back one gain and offset per part, found at the current pose",
        factory=lambda: part_colours,
        follows_pose=True,
    )
