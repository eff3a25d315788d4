"""The numbers of calibration from photographs. `Maskless` holds what a user may want to change; these are advanced.

Where no source is named, they come from a first prototype and from `lab_views` recordings and rendered photographs
that no table reports; see docs/maskless.md.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from hecbench_plugins.maskless.ball import Ball


class ColourModel(NamedTuple):
    """Of the compiled loops: how colours and edges vote for the place of a contour."""

    bins: int = 16
    """Of a colour histogram, per channel."""
    clip_nats: float = 4.0
    """Most that one pixel's colour may say."""
    neighbours_alike: float = 2.0
    """Neighbouring pixels of a line resemble each other: so many count as one."""
    edge_weight: float = 0.5
    """Nats for an edge of `edge_grey`."""
    edge_grey: float = 20.0
    """Grey levels of 255."""
    edge_most: float = 2.0
    """Edges, in units of `edge_grey`, beyond which stronger ones count no more."""
    background_sigma: float = 7.0
    """Grey levels of 255: noise of a known background."""
    histogram_share: float = 0.1
    """How often something else than the known background is seen beside the robot."""
    uniform_share: float = 0.03
    """How often a colour is none of those met before."""
    unlike_background: int = 12
    """Grey levels of 255 by which a pixel of the robot differs from the known background in some channel."""
    covered_often: float = 0.7
    """Share of the views that cover a pixel, from which on its background is not known well enough to exclude it."""
    free_least: float = 0.25
    """Least share of the views that must show a pixel's background for it to be known."""
    agree_share: float = 0.6
    """Of those views, so many must show the same colour."""
    empty: float = 1e-9
    """Added to every count, so that an empty cell has a logarithm."""
    most_covered: float = 0.9
    """Share of the views covering a pixel from which on its background is never seen."""
    covered_weight: float = 0.7
    """Cost, px, of covering a pixel that did not change, over that of leaving a changed one."""
    still_weight: float = 0.05
    """Cost, px, of covering a still pixel in all views."""


@dataclass(frozen=True)
class SearchSettings:
    """Of the search at low resolution.

    Attributes:
        level: of the meshes; pictures of `width_px` show no more.
        width_px: of the pictures.
        colours: clusters of k-means.
        lab_weights: of lightness and the two colour axes: a shadow changes the first most.
        kmeans_pixels, kmeans_rounds: that the clusters are found from, and in.
        motion_weight: px of motion consistency over nats of mutual information.
        prior_weight: cost at the radius of the ball.
        beyond_weight, limit: cost per radius beyond so many radii.
        still: difference from the background, in [0, 1], below which a pixel is still.
        region_poses, region_grow_px: poses whose silhouettes, grown by so much, bound where colours count.
        draws, draws_without_motion: poses drawn in a ball.
        apart: radii between draws that are followed.
        population, generations, first_sigma: of CMA-ES; the last in radii.
        settled: the search ends when its longest axis is so many of the first sigma.
    """

    level: int = 16
    width_px: int = 144
    colours: int = 32
    lab_weights: tuple[float, float, float] = (0.6, 1.6, 1.6)
    kmeans_pixels: int = 20_000
    kmeans_rounds: int = 30
    motion_weight: float = 4.0
    prior_weight: float = 5.0
    beyond_weight: float = 3e3
    limit: float = 1.2
    still: float = 0.3
    region_poses: int = 120
    region_grow_px: int = 9
    draws: int = 1000
    draws_without_motion: int = 3000
    apart: float = 0.5
    population: int = 32
    generations: int = 40
    first_sigma: float = 0.3
    settled: float = 1e-3


@dataclass(frozen=True)
class ContourSettings:
    """Of the refinement by contour points.

    Attributes:
        half_line: samples on each side of the contour.
        correlated_points: neighbouring contour points of an image that say as much as one alone.
        fewest_points: below which nothing is solved for.
        most_for_background: photographs that the background is taken from: more change it little, and cost memory and
            the square of the time.
        coarsest_px: largest width of the pictures of the first step.
        band_px: width of the band around the robot whose colours are its surroundings'.
        rows_beyond: rows of a picture read beyond the lines' reach: rounding, and the edge of the contour's last place.
        least_sigma_px: of a contour point.
        smooth_px: sigma of the blur before edges are looked for.
        clip_share: of the line's half length, beyond which a point does not count (Tukey).
        most_move_rad, most_move_m: of the camera in one step.
        settled: standard deviations of the answer that a move must not exceed for the refinement to have converged.
        damping: Marquardt's.
        same_direction: cosine between two moves from which on the second is lengthened; by most_relaxation at most.
        group_share, fewest_counts: how much of the histogram of all parts of one colour is mixed into a part's own,
            and the pixels below which that weight does not fall.
        sharp_px, centred_px: a contour point is confirmed when its posterior is narrower and nearer than this.
    """

    half_line: int = 8
    correlated_points: float = 30.0
    fewest_points: int = 30
    most_for_background: int = 40
    coarsest_px: int = 400
    band_px: int = 20
    rows_beyond: int = 4
    least_sigma_px: float = 0.7
    smooth_px: float = 0.8
    clip_share: float = 0.9
    most_move_rad: float = 0.1
    most_move_m: float = 0.05
    settled: float = 0.1
    damping: float = 1e-3
    same_direction: float = 0.8
    most_relaxation: float = 2.0
    group_share: float = 0.3
    fewest_counts: float = 50.0
    sharp_px: float = 2.0
    centred_px: float = 2.0


@dataclass(frozen=True)
class CourseSettings:
    """Of the whole course: where is searched, and what is believed.

    Attributes:
        near, far: how far off a start may be.
        search_views: photographs that are searched.
        fewest_for_far: views from which the larger ball is searched at once; fewer find the smaller one's end more
            surely.
        outside: radii of the ball beyond which an end is not believed.
        free_ball, free_starts: what the lattice of a search without a start leaves open about each of its starts, and
            how many are followed.
        roughly: standard deviations that a move may have before it is asked whether the arm carries something.
        tool_m, tool_share: of the contour this near the flange so much must be confirmed, against the rest, or
            something unknown is mounted there.
        joint_sigma_rad: of an arm's constant joint offsets about the nominal model.
        prior_freedom: degrees of freedom that `ContourSettings.correlated_points` weighs against the photographs' own
            scatter.
        doubtful: of the median share of confirmed contour; a photograph with less disagrees with the others.
    """

    near: Ball = field(default_factory=lambda: Ball(0.1, float(np.deg2rad(10))))
    far: Ball = field(default_factory=lambda: Ball(0.2, float(np.deg2rad(20))))
    search_views: int = 8
    fewest_for_far: int = 3
    outside: float = 1.4
    free_ball: Ball = field(default_factory=lambda: Ball(0.35, float(np.deg2rad(18))))
    free_starts: int = 6
    roughly: float = 4.0
    tool_m: float = 0.15
    tool_share: float = 0.6
    joint_sigma_rad: float = float(np.deg2rad(0.1))
    prior_freedom: float = 6.0
    doubtful: float = 0.5


COLOURS, SEARCH, CONTOUR, COURSE = ColourModel(), SearchSettings(), ContourSettings(), CourseSettings()

LATTICE_SEARCH = replace(SEARCH, draws=100, population=16)
"""About the starts of a lattice: 40 % of the time. Of 54 descents on sets of 5 photographs that no table reports, of
`ur3e_cam3` and of the lab, 41 ended right, and 39 with the numbers of `SEARCH`."""
