"""The frame in which the network says the camera, and the joints that it needs for that.

Turning the first joint moves the whole arm, and the camera that sees the same picture with it. So the pose relative to
the link which that joint moves depends on the other joints alone; forward kinematics gives the rest.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from hecbench.errors import InputError
from hecbench.robots.joints import Motion
from hecbench.robots.model import RobotModel
from hecbench.se3 import Array


def reference_link(model: RobotModel) -> str:
    """The link that the first joint moves.

    Raises:
        InputError: fewer than two joints move.
    """
    if len(model.joint_names) < 2:
        raise InputError(f"{model.name}: a robot with two joints or more is needed")
    return next(joint.child for joint in model.joints if joint.motion is not Motion.FIXED)


def posture(joints_rad: ArrayLike) -> Array:
    """(..., 2 (J - 1)): sines, then cosines of the joints (..., J) after the first."""
    others = np.asarray(joints_rad, float)[..., 1:]
    return np.concatenate([np.sin(others), np.cos(others)], -1)
