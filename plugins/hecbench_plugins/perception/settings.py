"""The advanced numbers of running a network and of the pose from its keypoints; training has its own."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ReadingSettings:
    """Of reading a picture.

    Attributes:
        coarse_px, fine_px: the longer sides of the picture in the first and second pass; the answers of a pass are
            averaged.
        fill: share of the second pass's picture that the robot takes.
        robot: share from which on a cell is robot.
        piece: of the largest piece's area: smaller pieces are not the robot.
        least_confidence: chosen between 60 photographs with a robot (least 0.29) and 63 without one (largest 0.25,
            95 % at 0.16).
        best_keypoints: whose trust makes the confidence.
        guide_cells, guide_softening: radius and variance (of RGB in [0, 1]) of the filter that moves a mask's edge to
            the image's.
        beyond: the logit of everything that the second pass does not show.
        heat_cells: a keypoint is the centre of its heatmap within so many cells of the highest.
    """

    coarse_px: tuple[int, ...] = (320, 448)
    fine_px: tuple[int, ...] = (224, 288)
    fill: float = 0.78
    robot: float = 0.5
    piece: float = 0.3
    least_confidence: float = 0.26
    best_keypoints: int = 3
    guide_cells: float = 1.5
    guide_softening: float = 1e-2
    beyond: float = -15.0
    heat_cells: int = 3


@dataclass(frozen=True)
class KeypointPoseSettings:
    """Of the pose from keypoints.

    Attributes:
        minimal_points: of one draw; the fourth decides between P3P's answers.
        near_m: points nearer to the camera than this count as that near.
        still_m: a keypoint that moves less than this between two views stands still.
        robust: of the limit: residuals beyond it count less (Cauchy).
        refinements: each after the sightings that agree are chosen anew.
    """

    minimal_points: int = 4
    near_m: float = 0.05
    still_m: float = 0.03
    robust: float = 0.15
    refinements: int = 3


READING, POSE = ReadingSettings(), KeypointPoseSettings()
