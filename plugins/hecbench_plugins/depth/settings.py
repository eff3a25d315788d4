"""The numbers of the alignment with depth."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hecbench_plugins.maskless.ball import Ball


@dataclass(frozen=True)
class Stage:
    """One size of the pictures: pixels between samples, the offset (m) that still counts, and most iterations."""

    level: int
    limit_m: float
    iterations: int


@dataclass(frozen=True)
class DepthSettings:
    """What a user may want to change first, then what is advanced.

    Attributes:
        noise_per_m: standard deviation of depth, m, at 1 m; it grows with the square of the distance (Keselman et al.
            2017). Used until the residuals give their own.
        around: how far off a start may be when the descent from the start itself fails.
        stages: coarse to fine.
        rough: how many of the stages come before an end is compared with the depth for the first time.
        settled: a stage ends at a step of so many standard deviations.
        floor_m: of a residual's standard deviation: the model's own error.
        grazing: least cosine between a face's normal and the ray; flatter ones are mostly smeared edges.
        agreeing_m, beyond_m: offset within which a pixel agrees, or four standard deviations where these are more but
            less than `beyond_m`, from which on the camera sees through the robot.
        least_agreeing, most_beyond: shares of the drawn pixels with depth, those with something before the robot left
            out, for an end to be an answer.
        least_pixels: drawn pixels with depth in all views.
        correlated_pixels: that say as much as one: a few matching windows of a stereo camera.
        draws, followed: poses drawn around a start, and how many of the best are followed.
        search_level, search_views: size and number of the pictures that draws are compared with.
        moved_level: size at which what moved is compared with an end.
        sphere_deg, sphere_starts: of a search without a start: spacing of its directions, and starts followed.
        sphere_distances: tried of the robot's middle, over the median depth of what moved, which is its near side.
        moved_m: a pixel nearer than the background by this and five standard deviations shows something that moved.
        least_explained: share of those pixels that must lie on the drawn robot, for a fixed camera.
        mask_sigma_px: of a mask's contour, its crossings correlated, for `silhouette`.
    """

    noise_per_m: float = 0.004
    around: Ball = field(default_factory=lambda: Ball(0.2, float(np.deg2rad(20.0))))
    stages: tuple[Stage, ...] = (
        Stage(8, 0.15, 15),
        Stage(4, 0.06, 10),
        Stage(2, 0.03, 6),
        Stage(1, 0.015, 4),
    )
    rough: int = 2
    settled: float = 0.1
    floor_m: float = 1e-3
    grazing: float = 0.25
    agreeing_m: float = 0.01
    beyond_m: float = 0.05
    least_agreeing: float = 0.85
    most_beyond: float = 0.12
    least_pixels: int = 500
    correlated_pixels: float = 70.0
    draws: int = 200
    followed: int = 8
    search_level: int = 16
    search_views: int = 4
    moved_level: int = 8
    sphere_deg: float = 15.0
    sphere_starts: int = 30
    sphere_distances: tuple[float, ...] = (1.0, 1.15)
    moved_m: float = 0.05
    least_explained: float = 0.4
    mask_sigma_px: float = 2.5
