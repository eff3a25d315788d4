"""Keypoints: where a robot's axes pass the middles of its links."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hecbench.errors import InputError
from hecbench.robots.joints import Motion
from hecbench.robots.model import RobotModel
from hecbench.se3 import Array

_SAME_POINT_M = 0.03
"""A link's points nearer than this are one."""
LINK_RADIUS_M = 0.06
"""About the radius of a link around its keypoints, which are middles."""


@dataclass(frozen=True)
class Keypoint:
    """A point fixed to a link: `position` (3,) m in the link's frame."""

    link: str
    position: tuple[float, float, float]


def keypoints_of(model: RobotModel) -> tuple[Keypoint, ...]:
    """The foot, and the points of each joint's axis that lie nearest to the middles of the two links it joins.

    Such points lie inside the robot, where they can be seen. Points of one link that nearly coincide are one.
    """
    middle = _middles(model)
    found = [Keypoint(model.links[0], (0.0, 0.0, 0.0))]
    root_T_link = model.link_poses(np.zeros(len(model.joint_names)))
    for joint in model.joints:
        if joint.motion is not Motion.REVOLUTE or joint.leader is not None:
            continue
        pose = root_T_link[model.link_index(joint.child)]
        axis, origin = pose[:3, :3] @ joint.axis, pose[:3, 3]
        for link in (joint.parent, joint.child):
            if link not in middle:
                continue
            link_pose = root_T_link[model.link_index(link)]
            point = origin + axis * (axis @ (link_pose[:3, :3] @ middle[link] + link_pose[:3, 3] - origin))
            local = link_pose[:3, :3].T @ (point - link_pose[:3, 3])
            near = (np.linalg.norm(local - k.position) < _SAME_POINT_M for k in found if k.link == link)
            if not any(near):
                found.append(Keypoint(link, (float(local[0]), float(local[1]), float(local[2]))))
    return tuple(found)


def keypoint_positions(links: Sequence[str], keypoints: Sequence[Keypoint], frame_T_link: ArrayLike) -> Array:
    """(..., K, 3) m of keypoints in the frame of frame_T_link (..., L, 4, 4) of L links.

    Raises:
        InputError: a keypoint belongs to none of the links.
    """
    absent = {k.link for k in keypoints} - set(links)
    if absent:
        raise InputError(f"the robot has no link '{min(absent)}', which a keypoint of the network belongs to")
    poses = np.asarray(frame_T_link, float)[..., [links.index(k.link) for k in keypoints], :, :]
    local = np.array([k.position for k in keypoints])
    return np.asarray((poses[..., :3, :3] @ local[..., None])[..., 0] + poses[..., :3, 3])


def _middles(model: RobotModel) -> dict[str, Array]:
    """The centroid (3,) m of each link's surface, in the link's frame."""
    sums: dict[str, Array] = {}
    for part in model.parts:
        corners = part.vertices[part.faces]
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        weighed = np.r_[(corners.mean(1) * area[:, None]).sum(0), area.sum()]
        sums[part.link] = sums.get(part.link, np.zeros(4)) + weighed
    return {link: total[:3] / total[3] for link, total in sums.items() if total[3] > 0}
