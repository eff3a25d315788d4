"""A start without a guess, after EasyHeC++ (Zheng et al. 2024): the best mask overlap of cameras on a hemisphere.

The authors' code is not published; what they sample is chosen here. Directions are spread evenly over the upper
hemisphere around the base's vertical axis (Fibonacci's spiral, Gonzalez 2010), the camera upright. Distance and
aim are not sampled: each camera is moved until centroid and area of its drawing are those of the mask.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hecbench import se3
from hecbench.errors import Refusal
from hecbench.recording import Mounting, Recording
from hecbench.se3 import Array
from hecbench_plugins.second_order.descent import Trace, draw_counted
from hecbench_plugins.second_order.silhouette import centroid_and_area
from hecbench_plugins.views.pyramid import View


@dataclass(frozen=True)
class Hemisphere:
    """The cameras to try; all numbers are chosen here.

    Attributes:
        directions: how many.
        first_distance_m: from the robot's middle, before centroid and area correct it.
        corrections: of distance and aim for each direction.
        level: the pictures are shrunk by this factor.
        highest_sine: of the elevation, up to which "upright" says how a camera is turned.
    """

    directions: int = 500
    first_distance_m: float = 2.0
    corrections: int = 3
    level: int = 4
    highest_sine: float = 0.98


@dataclass(frozen=True, eq=False)
class HemisphereStart:
    """The best camera, its overlap (mean intersection over union of the views) and how many were tried."""

    camera_T_parent: Array
    overlap: float
    candidates: int


def best_on_hemisphere(
    recording: Recording, views: Sequence[View], hemisphere: Hemisphere
) -> HemisphereStart:
    """Try every direction in shrunk pictures.

    Raises:
        Refusal: the camera sits on the robot, so that no hemisphere around the base holds it.
    """
    if recording.mounting is not Mounting.EYE_TO_HAND:
        raise Refusal("cameras are sampled around the base: a start can be searched for eye_to_hand only")
    middle = np.concatenate([view.parent_T_link[:, :3, 3] for view in views]).mean(0)
    best, best_overlap, trace = np.eye(4), -1.0, Trace()
    for direction in _directions(hemisphere):
        pose = se3.inverse(se3.looking(middle + hemisphere.first_distance_m * direction, middle))
        pose = centroid_and_area(views, pose, trace, rounds=hemisphere.corrections)
        overlap = _overlap(views, hemisphere.level, pose, trace)
        if overlap > best_overlap:
            best, best_overlap = pose, overlap
    return HemisphereStart(best, best_overlap, hemisphere.directions)


def _directions(hemisphere: Hemisphere) -> Array:
    """Unit vectors (D, 3) from the robot to the camera, even in the sine of the elevation."""
    n = np.arange(hemisphere.directions)
    sine = hemisphere.highest_sine * (n + 0.5) / hemisphere.directions
    azimuth = n * np.pi * (3 - np.sqrt(5))
    cosine = np.sqrt(1 - sine**2)
    return np.stack([cosine * np.cos(azimuth), cosine * np.sin(azimuth), sine], -1)


def _overlap(views: Sequence[View], level: int, pose: Array, trace: Trace) -> float:
    values = []
    for view in views:
        at = draw_counted(view, level, pose, trace)
        drawn, seen = at.drawn(), at.observed[..., 3] > 0.5
        values.append((drawn & seen).sum() / max((drawn | seen).sum(), 1))
    return float(np.mean(values))
