"""The advanced numbers of the marker methods around their equations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class HandEyeSettings:
    """Of the methods that solve AX = XB or AX = YB.

    Attributes:
        least_samples: that a method takes.
        most_compared: samples whose motions are all formed: their number, and OpenCV's time, grow with the square.
        least_rotation_deg: rms rotation that must remain about a second axis, ten times a good robot's noise, or
            nothing is observable.
    """

    least_samples: int = 3
    most_compared: int = 800
    least_rotation_deg: float = 1.0


@dataclass(frozen=True)
class TargetPoseSettings:
    """Of which of two planar poses is right.

    Attributes:
        least_points: of the target that a picture must show.
        pixel_sigma_px, angle_sigma_rad: of a corner, and of a turn between two samples.
        robust_limit: a pair of samples costs at most (5 sigma)^2, so that one bad robot pose does not decide for the
            others.
        compared: samples whose poses are chosen by all their pairs; any others are chosen against these, so that time
            grows with their number only.
    """

    least_points: int = 4
    pixel_sigma_px: float = 0.5
    angle_sigma_rad: float = float(np.deg2rad(1.0))
    robust_limit: float = 25.0
    compared: int = 60


@dataclass(frozen=True)
class AdjustmentStartSettings:
    """Of the starts of a bundle adjustment.

    Attributes:
        starts: descents, from the starts with the least residuals.
        most_votes: poses compared each with each.
        agreeing_rad: between turns of the target that agree: PnP of a small target is off by degrees, a mirrored pose
            by tens.
    """

    starts: int = 2
    most_votes: int = 400
    agreeing_rad: float = float(np.deg2rad(8.0))


@dataclass(frozen=True)
class Single3dSettings:
    """Of the methods that use the target's position alone.

    Attributes:
        coplanar_condition: above it the marker positions nearly lie in a plane and the closed form is off by
            decimetres; healthy is 5.
        most_compared: samples compared each with each.
        iterations: of Gauss and Newton's descent, at most.
        least_step_rad: length of a step below which it has converged.
        rounding: relative rise of the cost that is rounding, no reason to halve a step.
    """

    coplanar_condition: float = 300.0
    most_compared: int = 400
    iterations: int = 100
    least_step_rad: float = 1e-11
    rounding: float = 1e-13


HAND_EYE, TARGET_POSES = HandEyeSettings(), TargetPoseSettings()
ADJUSTMENT_STARTS, SINGLE3D = AdjustmentStartSettings(), Single3dSettings()
