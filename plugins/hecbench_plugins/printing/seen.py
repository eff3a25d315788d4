"""What a camera without distortion sees of a printed page: pictures whose points are known exactly."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError
from hecbench.se3 import Array
from hecbench.targets import AprilGridTarget, AprilTagTarget, ArucoTarget, ChessboardTarget, Target
from hecbench_plugins.printing.shapes import Pattern, Rectangle, pattern

_BLACK, _CONTRAST = 30.0, 200.0


def seen(
    target: Target,
    K: Array,
    camera_T_target: Array,
    size: tuple[int, int],
    *,
    blur_px: float = 0.6,
    noise: float = 0.0,
    rng: np.random.Generator | None = None,
    pixels_per_mm: float = 12.0,
    samples: int = 6,
) -> NDArray[np.uint8]:
    """Grey levels (height, width), pixel centres at integers; every pixel is the mean of its samples.

    Args:
        target: of flat rectangles: any but dots.
        K: (3, 3) px.
        camera_T_target: (4, 4) m.
        size: width and height, px.
        blur_px: standard deviation of the lens's blur.
        noise: standard deviation of grey levels, drawn from `rng`.
        pixels_per_mm: of the page before it is seen.
        samples: across and down a pixel.

    Raises:
        InputError: the target has dots.
    """
    import cv2

    shown = pattern(target)
    page, page_from_target = _page(target, shown, pixels_per_mm)
    middle = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])
    finer = np.array([[samples, 0, (samples - 1) / 2], [0, samples, (samples - 1) / 2], [0, 0, 1]])
    image_from_page = finer @ K @ camera_T_target[:3][:, [0, 1, 3]] @ np.linalg.inv(page_from_target) @ middle
    columns, rows = size
    fine = cv2.warpPerspective(page, image_from_page, (columns * samples, rows * samples), borderValue=1.0)
    grey = _BLACK + _CONTRAST * cv2.GaussianBlur(
        fine.reshape(rows, samples, columns, samples).mean((1, 3)), (0, 0), blur_px
    )
    if rng is not None:
        grey = grey + rng.normal(0.0, noise, grey.shape)
    return np.asarray(np.clip(np.rint(grey), 0, 255), np.uint8)


def _page(target: Target, shown: Pattern, pixels_per_mm: float) -> tuple[NDArray[np.float32], Array]:
    """The page (h, w) in 0..1, and what takes x, y (m) of the target's frame to its pixels' corners."""
    height, width = (round((side + 2 * shown.quiet) * pixels_per_mm) for side in (shown.height, shown.width))
    page = np.ones((height, width), np.float32)
    for r in shown.shapes:
        if not isinstance(r, Rectangle):
            raise InputError(f"{target.kind}: dots are not drawn as seen; give a target of squares")
        near, far = ((x + shown.quiet) * pixels_per_mm for x in (r.x, r.x + r.width))
        top, low = (height - (y + shown.quiet) * pixels_per_mm for y in (r.y + r.height, r.y))
        page[round(top) : round(low), round(near) : round(far)] = 0
    (x, y), right, up = _origin(target, shown)
    scale = 1e3 * pixels_per_mm
    page_from_target = np.array(
        [
            [right * scale, 0, (x + shown.quiet) * pixels_per_mm],
            [0, -up * scale, height - (y + shown.quiet) * pixels_per_mm],
            [0, 0, 1],
        ]
    )
    return page, page_from_target


def _origin(target: Target, shown: Pattern) -> tuple[tuple[float, float], int, int]:
    """Where the target's frame lies in the pattern, mm from the lower left; 1 where its x points right, its y up."""
    centre = shown.width / 2, shown.height / 2
    if isinstance(target, ArucoTarget):
        return centre, 1, 1
    if isinstance(target, AprilTagTarget):
        return centre, 1, -1
    if isinstance(target, AprilGridTarget):
        return (shown.quiet, shown.quiet), 1, 1
    if isinstance(
        target, ChessboardTarget
    ):  # the printed board's first square is its light one, at the lower right
        return (shown.width - 1e3 * target.square_m, 1e3 * target.square_m), -1, 1
    return (0.0, shown.height), 1, -1
