"""Pictures that are about to be shrunk."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

_SMOOTHING = 0.35
"""Standard deviation of the blur before shrinking, in pixels of the small picture: it keeps aliases out."""
_BLUR_BELOW = 0.6


def softened(image: NDArray[np.uint8], scale: float) -> NDArray[np.uint8]:
    """The picture (H, W, 3), blurred if it shall be resampled to `scale` of its size and that is much less."""
    if scale >= _BLUR_BELOW:
        return image
    return np.asarray(cv2.GaussianBlur(image, (0, 0), _SMOOTHING / scale), np.uint8)
