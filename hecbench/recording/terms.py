"""What a recording is described with: what it may offer, where the camera sits, which robot moves."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.se3 import Array

Image = NDArray[np.uint8]
ImageSource = Path | Image | NDArray[np.uint16] | None
"""A file that is decoded when asked for, an array in memory, or nothing for this sample."""


class Need(StrEnum):
    """What a recording can offer, and what a solver asks of it."""

    TARGET_POSES = "target_poses"
    CORNERS = "corners"
    INTRINSICS = "intrinsics"
    IMAGES = "images"
    MASKS = "masks"
    DEPTH = "depth"
    JOINTS = "joints"
    ROBOT_MODEL = "robot_model"
    INITIAL = "initial"


class Mounting(StrEnum):
    """Where the camera sits: fixed beside the robot, or on its flange."""

    EYE_TO_HAND = "eye_to_hand"
    EYE_IN_HAND = "eye_in_hand"


@dataclass(frozen=True, kw_only=True)
class RobotDescription:
    """The arm by name or URDF file, and the two links between which `base_T_flange` is given."""

    model: str | None = None
    urdf: Path | None = None
    base_link: str = "base"
    flange_link: str = "tool0"
    joint_names: tuple[str, ...] = ()

    @property
    def source(self) -> str | Path | None:
        """What `load_robot` takes: the URDF where there is one, or the name; None when neither is known."""
        return self.urdf or self.model


def hand_poses(mounting: Mounting, base_T_flange: Array) -> Array:
    """H (..., 4, 4) m of `Recording.hand_poses` for flange poses (..., 4, 4), and back."""
    return base_T_flange if mounting is Mounting.EYE_TO_HAND else se3.inverse(base_T_flange)
