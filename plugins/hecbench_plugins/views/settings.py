"""The numbers of what renderer methods compare: pictures and masks."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PyramidSettings:
    """Of the pyramid of a view.

    Attributes:
        levels: pixels of the recording per pixel of a level, coarse to fine.
        least_px: of a picture's side: eight pixels at the coarsest of the levels.
        least_mask, most_mask: share of the picture that a mask covers.
        background_spread: standard deviation of the colours outside the mask, of full brightness, from which on the
            background is not uniform.
        smallest_hiding_px: of a thing before the robot.
        soft_edge_px: width of the blur at the robot's edge.
    """

    levels: tuple[int, ...] = (4, 2, 1)
    least_px: int = 32
    least_mask: float = 1e-3
    most_mask: float = 0.95
    background_spread: float = 0.08
    smallest_hiding_px: int = 9
    soft_edge_px: int = 2


@dataclass(frozen=True)
class CanvasSettings:
    """Of the canvas that pictures without a lens are drawn on.

    Attributes:
        pad_px: by which the canvas is larger than the image on each side: a lens bends the robot's base out of the
            image.
        largest_px: wider canvases are shrunk: a contour is found to a fraction of a pixel anyway.
        grid_px: of which the canvas's sides are multiples.
        widest: largest side of a drawn silhouette's canvas over that of the image.
    """

    pad_px: int = 60
    largest_px: int = 1600
    grid_px: int = 8
    widest: float = 3.0


PYRAMID, CANVAS = PyramidSettings(), CanvasSettings()
