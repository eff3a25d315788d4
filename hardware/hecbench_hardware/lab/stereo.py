"""What a stereo depth camera makes of exact depth.

Keselman et al. 2017, "Intel RealSense stereoscopic depth cameras", CVPR workshops: the error of depth is
``z^2 / (f b)`` times that of the disparity, some 0.1 px; disparities are rounded to a fraction of a pixel; the matching
window smears foreground over depth edges; what the second camera does not see has no depth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Depth = NDArray[np.float32]


@dataclass(frozen=True)
class StereoSensor:
    """A stereo camera; the defaults are those of a small one at 640 px.

    Attributes:
        baseline_m: between its two cameras.
        disparity_sigma_px: of a pixel's disparity, correlated over the window.
        steps_per_px: to which disparities are rounded.
        window_px: side of the matching window.
        nearest_m, farthest_m: what it measures.
        dropout: share of further pixels without depth.
    """

    baseline_m: float = 0.05
    disparity_sigma_px: float = 0.12
    steps_per_px: int = 16
    window_px: int = 5
    nearest_m: float = 0.25
    farthest_m: float = 6.0
    dropout: float = 0.01

    def __call__(self, depth_m: Depth, focal_px: float, rng: np.random.Generator) -> NDArray[np.uint16]:
        """Millimetres (H, W) of 16 bits, 0 where unknown, from exact depth (H, W) m."""
        disparity = focal_px * self.baseline_m / np.maximum(depth_m, 1e-3)
        seen = self._in_both(disparity)
        reach = self.window_px // 2
        smeared = ndimage.maximum_filter(disparity, self.window_px)
        at_edge = smeared - ndimage.minimum_filter(disparity, self.window_px) > 1
        keep = ndimage.uniform_filter(rng.random(disparity.shape), self.window_px) < 0.5
        disparity = np.where(at_edge & keep, smeared, disparity)
        noise = ndimage.uniform_filter(rng.standard_normal(disparity.shape), self.window_px)
        disparity = disparity + noise * self.disparity_sigma_px / noise.std()
        disparity = np.rint(disparity * self.steps_per_px) / self.steps_per_px
        found_m = focal_px * self.baseline_m / np.maximum(disparity, 1e-3)
        known = seen & (found_m > self.nearest_m) & (found_m < self.farthest_m)
        known &= rng.random(disparity.shape) >= self.dropout
        known[:, :reach] = known[:, -reach:] = False
        return np.where(known, np.rint(1e3 * found_m), 0).astype(np.uint16)

    @staticmethod
    def _in_both(disparity: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Whether the right camera sees each pixel (H, W): nothing nearer is in the way, and it is in the picture."""
        place = np.arange(disparity.shape[1]) - disparity
        nearest = np.minimum.accumulate(place[:, ::-1], axis=1)[:, ::-1]
        return np.asarray((place <= nearest + 0.5) & (place >= 0))
