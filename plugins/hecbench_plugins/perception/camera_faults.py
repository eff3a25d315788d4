"""What a camera does to a picture: light fall-off, exposure, white balance, blur, sharpening, noise, JPEG."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Rng = np.random.Generator


def photographed(picture: Floats, rng: Rng) -> NDArray[np.uint8]:
    """The picture (S, S, 3), linear RGB of any positive range, as 8 bits."""
    x = _exposed(picture, rng)
    x = _focused(x, rng)
    x = x + rng.standard_normal(x.shape, np.float32) * np.float32(rng.uniform(0, 0.04))
    if rng.random() < 0.1:
        _cover(x, rng)
    out = np.rint(np.clip(x, 0, 1) * 255).astype(np.uint8)
    if rng.random() < 0.5:
        quality = [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(35, 96))]
        out = np.asarray(cv2.imdecode(cv2.imencode(".jpg", out, quality)[1], cv2.IMREAD_COLOR), np.uint8)
    return out


def _exposed(x: Floats, rng: Rng) -> Floats:
    if rng.random() < 0.5:
        ramp = np.linspace(-1, 1, len(x), dtype=np.float32)
        down, across = rng.uniform(-0.4, 0.4, 2).astype(np.float32)
        x = x * (1 + down * ramp[:, None] + across * ramp[None])[..., None]
    x = x * (rng.uniform(0.6, 1.35) * (1 + rng.normal(0, 0.06, 3))).astype(np.float32)
    x = np.clip(x + np.float32(rng.normal(0, 0.03)), 0, 1) ** np.float32(np.exp(rng.normal(0, 0.25)))
    if rng.random() < 0.3:
        grey = x.mean(-1, keepdims=True)
        x = grey + np.float32(rng.uniform(0, 1.5)) * (x - grey)
    return x.astype(np.float32)


def _focused(x: Floats, rng: Rng) -> Floats:
    kind, side = rng.random(), len(x)
    if kind < 0.5:
        return np.asarray(cv2.GaussianBlur(x, (0, 0), rng.uniform(0.3, 1.5)), np.float32)
    if kind < 0.6:
        small = max(48, int(side * rng.uniform(0.35, 0.9)))
        x = cv2.resize(x, (small, small), interpolation=cv2.INTER_AREA)
        return np.asarray(cv2.resize(x, (side, side), interpolation=cv2.INTER_CUBIC), np.float32)
    if kind < 0.7:
        soft = cv2.GaussianBlur(x, (0, 0), rng.uniform(0.6, 2))
        return np.asarray(x + np.float32(rng.uniform(0.3, 1.5)) * (x - soft), np.float32)
    if kind < 0.75:  # motion
        length = int(rng.integers(2, 6))
        kernel = np.zeros((length, length), np.float32)
        cv2.line(kernel, (0, int(rng.integers(length))), (length - 1, int(rng.integers(length))), 1.0)
        return np.asarray(cv2.filter2D(x, -1, kernel / kernel.sum()), np.float32)
    return x


def _cover(x: Floats, rng: Rng) -> None:
    """A patch without information, as dirt on the lens."""
    height, width = rng.integers(8, len(x) // 3, 2)
    top, left = rng.integers(0, len(x) - height), rng.integers(0, len(x) - width)
    x[top : top + height, left : left + width] = rng.uniform(0, 1, 3)
