"""Pictures of what was detected, to be looked at."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hecbench.recording import Recording
from hecbench.system import files
from hecbench.system.pictures import encode_png

Picture = NDArray[np.uint8]

_RED, _GREEN, _WHITE = (230, 40, 40), (40, 220, 60), (255, 255, 255)
_SUBPIXEL_BITS = 4


def overlay(recording: Recording, index: int) -> Picture:
    """The image (height, width, 3), its corners joined in order, the first one ringed, and their count."""
    import cv2

    picture = recording.image(index).copy()
    corners = recording.corners_px
    seen = np.zeros((0, 2)) if corners is None else corners[index][np.isfinite(corners[index, :, 0])]
    size = max(1, round(max(picture.shape[:2]) / 640))
    at = np.rint(seen * (1 << _SUBPIXEL_BITS)).astype(np.int32)
    if len(at):
        cv2.polylines(picture, [at], False, _RED, size, cv2.LINE_AA, _SUBPIXEL_BITS)
        for point in at.tolist():
            cv2.circle(
                picture, point, (3 * size) << _SUBPIXEL_BITS, _GREEN, size, cv2.LINE_AA, _SUBPIXEL_BITS
            )
        first = at[0].tolist()
        cv2.circle(picture, first, (8 * size) << _SUBPIXEL_BITS, _RED, 2 * size, cv2.LINE_AA, _SUBPIXEL_BITS)
    label = f"{recording.sample_ids[index]}: {len(seen)} points"
    for colour, width in ((0, 0, 0), 4 * size), (_WHITE, size):
        cv2.putText(
            picture,
            label,
            (8 * size, 20 * size),
            cv2.FONT_HERSHEY_SIMPLEX,
            0.6 * size,
            colour,
            width,
            cv2.LINE_AA,
        )
    return picture


def write_overlays(recording: Recording, folder: Path) -> list[Path]:
    """One PNG per sample that has an image, named by the sample."""
    written = []
    for i, sample_id in enumerate(recording.sample_ids):
        if recording.images is not None and recording.images[i] is not None:
            path = folder / f"{files.safe_name(sample_id)}.png"
            files.write_bytes(path, encode_png(overlay(recording, i)))
            written.append(path)
    return written
