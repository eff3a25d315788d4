"""How large a robot is, and which parts cannot be of that size."""

from __future__ import annotations

import numpy as np

from hecbench import se3
from hecbench.robots.model import RobotModel
from hecbench.se3 import Array
from hecbench.system.wording import significant

_WIDER = 20.0
"""A part wider than its robot's reach by this factor is in another unit: millimetres are a thousand."""


def reach_m(model: RobotModel) -> float:
    """The longest sum of joint offsets from the root to a link, m."""
    away = {model.links[0]: 0.0}
    for joint in model.joints:
        away[joint.child] = away[joint.parent] + float(np.linalg.norm(joint.origin[:3, 3]))
    return max(away.values())


def oversized(model: RobotModel) -> tuple[str, ...]:
    """One sentence with the cure for each mesh that is far wider than the robot's reach."""
    reach = reach_m(model)
    found = {}
    for part in model.parts:
        width = float(np.ptp(part.vertices, axis=0).max())
        if reach > 0 and width > _WIDER * reach:
            name = f"mesh {part.source}" if part.source else f"part {part.name}"
            found[name] = (
                f"{name} is {significant(width, 4)} m wide, the robot reaches {significant(reach)} m: in millimetres? "
                'add scale="0.001 0.001 0.001"'
            )
    return tuple(found.values())


def resting(model: RobotModel) -> Array:
    """Positions (J,) of the model's joints: zero, or the nearest limit."""
    limits = np.sort(model.limits(), axis=1)
    return np.asarray(np.clip(0.0, limits[:, 0], limits[:, 1]))


def placed(model: RobotModel, positions: Array) -> Array:
    """The vertices (V, 3) m of all parts in the root's frame."""
    poses = model.link_poses(positions)
    points = [se3.transform_points(poses[model.link_index(part.link)], part.vertices) for part in model.parts]
    return np.concatenate(points) if points else np.zeros((0, 3))
