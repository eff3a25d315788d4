"""The numbers of the detectors. Where no source is named, they follow from what is said of them.

Units are pixels of the picture unless a name says otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class EdgeSettings:
    """Of a dark quadrilateral's edges.

    Attributes:
        ends: share of an edge left out at either end.
        step_px: between the places that are read across an edge.
        reach_cells, reach_px: half the width that is read, in the square's cells (the next edge is a cell away), and
            at least and at most.
        rounds: of fitting lines where the last ones were.
        farthest_px: by which a corner may move in all.
        least_contrast: grey levels between the two sides.
    """

    ends: float = 0.15
    step_px: float = 0.25
    reach_cells: float = 0.7
    reach_px: tuple[float, float] = (1.5, 4.0)
    rounds: int = 4
    farthest_px: float = 4.0
    least_contrast: float = 8.0


@dataclass(frozen=True)
class ChessboardSettings:
    """Of chessboards.

    Attributes:
        window_px: half the window of the refinement, at least and at most.
        least_contrast: between the squares of the two colours, in standard deviations of all; 2 on a clean board.
        into_square: how far from a corner towards the next ones a square is looked at, in squares.
        least_crossing: how much lighter the darker light square at a corner is than any dark one, over the difference
            between the squares around it.
        least_height_px: of the shorter side of the shrunk picture that is searched first; one four times as large
            takes six times as long.
    """

    window_px: tuple[int, int] = (2, 10)
    least_contrast: float = 1.2
    into_square: tuple[float, ...] = (0.2, 0.3, 0.4)
    least_crossing: float = 0.2
    least_height_px: int = 360


@dataclass(frozen=True)
class CircleSettings:
    """Of circle grids.

    Attributes:
        larger: diameter of the dot that marks the first, over its neighbours'.
        least_area_px: of a dot.
    """

    larger: float = 1.25
    least_area_px: float = 20.0


@dataclass(frozen=True)
class MarkerSettings:
    """Of markers, their grids and tags.

    Attributes:
        borders: cells of a marker's black border: OpenCV's and the AprilTag library's, and Kalibr's.
        widenings_px: by which the white is widened: not at all, and so that squares that touch come apart.
        placed: sides of a marker by which its corners may miss the grid: more than a lens bends it, less than any
            other layout.
        well_placed: share of the markers seen that must lie where the layout has them.
        mostly: share of the pictures from which on a tag seen twice in them is refused.
    """

    borders: tuple[int, int] = (1, 2)
    widenings_px: tuple[int, int] = (1, 3)
    placed: float = 0.12
    well_placed: float = 0.8
    mostly: float = 0.5


@dataclass(frozen=True)
class OrientationSettings:
    """Of which end of a grid comes first.

    Attributes:
        angle_sigma_rad: of a turn of the target between two samples, by PnP.
        robust_limit: squared sigmas that a pair of samples costs at most.
        irregular: rms misfit of a homography, in cells, from which on points are no grid.
    """

    angle_sigma_rad: float = float(np.deg2rad(2.0))
    robust_limit: float = 25.0
    irregular: float = 0.15


@dataclass(frozen=True)
class IntrinsicsSettings:
    """Of a camera calibrated from its pictures.

    Attributes:
        least_images, least_points: that a calibration takes, and that a picture must show.
        as_well: mean squared error of prediction over that of the best lens.
        corner_share: standard deviation of what the last radial term moves a point in the picture's corner, over its
            distance from the middle.
        folds: of the views, left out in turn.
        most_compared: views that the lens models are compared on.
        most_uncertain, most_uncertain_centre: standard deviations beyond which the views are said to leave a parameter
            open: of the focal length, over itself, and of the centre, over the picture's width.
        least_tilt_rad: between the target's poses.
        same_px: views whose points lie this near to each other, rms, are one: the arm stood still.
    """

    least_images: int = 3
    least_points: int = 6
    as_well: float = 1.05
    corner_share: float = 0.01
    folds: int = 5
    most_compared: int = 20
    most_uncertain: float = 0.1
    most_uncertain_centre: float = 0.02
    least_tilt_rad: float = float(np.deg2rad(8.0))
    same_px: float = 0.7


EDGES, CHESSBOARD, CIRCLES, MARKERS = EdgeSettings(), ChessboardSettings(), CircleSettings(), MarkerSettings()
ORIENTATION, INTRINSICS = OrientationSettings(), IntrinsicsSettings()
