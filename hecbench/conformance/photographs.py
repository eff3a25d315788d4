"""Drawn photographs of a robot, with masks and truth, for the checks of plugins that look at one."""

from __future__ import annotations

from functools import cache

import numpy as np

from hecbench import se3
from hecbench.recording import CameraModel, Mounting, Recording, RobotDescription
from hecbench.rendering import Renderer, RenderMesh
from hecbench.robots.posed import cached_robot

ROBOT = "ur5e"
_VIEWS = 4
_CAMERA = CameraModel(320, 240, np.array([[320.0, 0, 159.5], [0, 320.0, 119.5], [0, 0, 1]]))
_EYE_M, _AIM_M = np.array([1.9, 0.4, 0.6]), np.array([0.1, 0.0, 0.4])
_START_M, _START_RAD = 0.03, np.deg2rad(3)
"""Length and angle by which the start is off."""
_WALL_M = 3.0
_POSE_RAD = np.deg2rad([0, -100, 90, -70, -90, 0])
"""The joints about which the views differ by up to 0.5 rad: an arm that stands up, elbow bent."""


@cache
def photographs() -> Recording:
    """Four views of a fixed camera: images with a textured wall, exact masks and depth, a start, and the truth."""
    rng = np.random.default_rng(0)
    model = cached_robot(ROBOT)
    base_T_camera = se3.looking(_EYE_M, _AIM_M)
    joints = _POSE_RAD + rng.uniform(-0.5, 0.5, (_VIEWS, len(_POSE_RAD)))
    renderer = Renderer(RenderMesh.of(model, cell_m=0.002), _CAMERA.intrinsics, _CAMERA.width, _CAMERA.height)
    wall = np.repeat(np.repeat(rng.uniform(0.2, 0.8, (24, 32, 3)), 10, 0), 10, 1)
    images, masks, depths = [], [], []
    for base_T_link in model.link_poses(joints, frame="base"):
        renderer.draw(se3.inverse(base_T_camera) @ base_T_link)
        drawn = renderer.image()
        picture = drawn[..., :3] + (1 - drawn[..., 3:]) * wall
        images.append(np.round(255 * np.clip(picture, 0, 1)).astype(np.uint8))
        depths.append(np.rint(1e3 * np.minimum(renderer.depth, _WALL_M)).astype(np.uint16))
        masks.append(np.where(drawn[..., 3] >= 0.5, 255, 0).astype(np.uint8))
    off = np.concatenate([_direction(rng) * _START_RAD, _direction(rng) * _START_M])
    return Recording(
        name="photographs",
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=tuple(f"{view:06d}" for view in range(_VIEWS)),
        robot=RobotDescription(model=ROBOT, joint_names=model.joint_names),
        camera=_CAMERA,
        initial_parent_T_camera=base_T_camera @ se3.exp(off),
        truth_parent_T_camera=base_T_camera,
        base_T_flange=model.forward(joints, base="base", tip="tool0"),
        joints_rad=joints,
        depths=tuple(depths),
        images=tuple(images),
        masks=tuple(masks),
    )


def _direction(rng: np.random.Generator) -> np.ndarray:
    vector = rng.normal(size=3)
    return np.asarray(vector / np.linalg.norm(vector))
