"""The closed set of things that solvers ask of a recording."""

from enum import StrEnum


class Need(StrEnum):
    """What a solver asks of a recording."""

    TARGET_POSES = "target_poses"
    CORNERS = "corners"
    INTRINSICS = "intrinsics"
    IMAGES = "images"
    MASKS = "masks"
    JOINTS = "joints"
    ROBOT_MODEL = "robot_model"
    INITIAL = "initial"
