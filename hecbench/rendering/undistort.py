"""Undistorted pictures: one resampling of image or mask, after which the camera is an exact pinhole."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError
from hecbench.lens import distort
from hecbench.recording import CameraModel
from hecbench.se3 import Array


@dataclass(frozen=True, eq=False)
class Undistortion:
    """The pinhole camera `K` that stands for a real one, and where each of its pixels lies in the real image."""

    K: Array
    _source: Array | None

    @staticmethod
    def of(camera: CameraModel) -> Undistortion:
        """The pinhole camera with the same K and size.

        Raises:
            InputError: K is unknown.
        """
        if camera.K is None:
            raise InputError("camera.K is unknown: calibrate the intrinsics first")
        if camera.is_pinhole:
            return Undistortion(camera.K, None)
        v, u = np.mgrid[0 : camera.height, 0 : camera.width].astype(float)
        rays = np.stack([u, v, np.ones_like(u)], -1) @ np.linalg.inv(camera.K).T
        distorted = distort(rays[..., :2], camera)
        homogeneous = np.concatenate([distorted, np.ones_like(distorted[..., :1])], -1)
        pixels = homogeneous @ camera.K.T
        return Undistortion(camera.K, np.stack([pixels[..., 1], pixels[..., 0]]))

    def image(self, picture: NDArray[np.generic]) -> NDArray[np.float32]:
        """An image (H, W, C) or mask (H, W) in [0, 1], resampled linearly; 8-bit values are divided by 255."""
        scale = 1 / 255 if picture.dtype == np.uint8 else 1.0
        values = np.asarray(picture, np.float32) * np.float32(scale)
        if self._source is None:
            return values
        resampled = np.empty((*self._source.shape[1:], values[0, 0].size), np.float32)
        _resample(values.reshape(*values.shape[:2], -1), self._source, resampled)
        return resampled.reshape(values.shape)


@numba.njit(cache=True, nogil=True)
def _resample(picture, source, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Fill `out` (H, W, C) by linear interpolation of `picture` at rows and columns `source` (2, H, W), else 0."""
    height, width, channels = picture.shape
    for y in range(out.shape[0]):
        for x in range(out.shape[1]):
            v, u = source[0, y, x], source[1, y, x]
            if not (0 <= v <= height - 1 and 0 <= u <= width - 1):
                for c in range(channels):
                    out[y, x, c] = 0.0
                continue
            top, left = min(int(v), height - 2), min(int(u), width - 2)
            down, across = v - top, u - left
            for c in range(channels):
                upper = picture[top, left, c] * (1 - across) + picture[top, left + 1, c] * across
                lower = picture[top + 1, left, c] * (1 - across) + picture[top + 1, left + 1, c] * across
                out[y, x, c] = upper * (1 - down) + lower * down


def shrunk_intrinsics(K: Array, across: float, down: float | None = None) -> Array:
    """K of an image resized by these factors, pixel centres at integers before and after; down None: as across."""
    scale = np.array([across, across if down is None else down])
    small = K.copy()
    small[:2] *= scale[:, None]
    small[:2, 2] += 0.5 * scale - 0.5
    return small
