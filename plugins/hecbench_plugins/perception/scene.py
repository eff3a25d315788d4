"""Random postures of an arm and random cameras that look at it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.rendering import Renderer
from hecbench.se3 import Array
from hecbench_plugins.perception.family import Arm
from hecbench_plugins.perception.skeleton import LINK_RADIUS_M

Rng = np.random.Generator

SUPERSAMPLING = 2
"""Pixels drawn per pixel of the picture, along each axis."""

_TRIES = 50
LOWEST_M = 0.03
"""No keypoint above the foot may be lower: the floor is in the way."""
TAUGHT = 0.3
"""Share of postures near right angles, as people teach them; within `TAUGHT_NOISE_RAD` of them."""
TAUGHT_NOISE_RAD = 0.15
APART_M = 0.1
"""Keypoints that are not neighbours along the arm may not be nearer: links would pass through each other."""
DISTANCE_M = (0.35, 2.6)
"""Of the camera from the robot's nearest reach, on a logarithmic scale."""
USUAL, USUAL_DEG, ALL_DEG = 0.85, (-15.0, 65.0), (-30.0, 85.0)
"""Of the camera's elevation: the share of usual ones, their range, and that of the others."""
_SHARE = (0.3, 1.3)
"""The robot's extent as a share of the picture's side, on a logarithmic scale: beyond 1 it leaves the picture."""
_LEAST_COVER = 0.01
"""Of the picture, by the robot; smaller robots are drawn again."""


@dataclass(eq=False)
class Scene:
    """An arm before a camera, drawn `SUPERSAMPLING` times as large as the picture."""

    arm: Arm
    joints_rad: Array
    """(J,) of the model's joints."""
    base_T_link: Array
    camera_T_base: Array
    K: Array
    """(3, 3) px of the picture, pixel centres at integers."""
    size: int
    """Of the picture, px."""
    renderer: Renderer

    @property
    def camera_T_link(self) -> Array:
        """(L, 4, 4)."""
        return np.asarray(self.camera_T_base @ self.base_T_link)

    @property
    def fine_K(self) -> Array:
        """(3, 3) px of the drawing."""
        return supersampled(self.K)

    def keypoint_pixels(self) -> NDArray[np.float32]:
        """(K, 2) px of the picture; NaN behind the camera."""
        return pixels_of(self.arm.keypoint_positions(self.camera_T_link), self.K)


def pixels_of(points_c: Array, K: Array) -> NDArray[np.float32]:
    """(N, 2) px of points (N, 3) m in the camera's frame, without a lens; NaN behind the camera."""
    with np.errstate(all="ignore"):
        pixels = points_c[:, :2] / points_c[:, 2:] * [K[0, 0], K[1, 1]] + K[:2, 2]
    return np.where(points_c[:, 2:] > 0, pixels, np.nan).astype(np.float32)


def supersampled(K: Array) -> Array:
    """The intrinsics of a picture drawn `SUPERSAMPLING` times as large."""
    fine = np.diag([SUPERSAMPLING, SUPERSAMPLING, 1.0]) @ K
    fine[:2, 2] += (SUPERSAMPLING - 1) / 2
    return fine


def random_scene(arm: Arm, size: int, rng: Rng) -> Scene:
    """A posture and a camera that sees at least some of it."""
    joints_rad, base_T_link = random_posture(arm, rng)
    points = arm.keypoint_positions(base_T_link)
    while True:
        camera_T_base, K = random_camera(points, size, rng)
        side = SUPERSAMPLING * size
        renderer = Renderer(arm.mesh, supersampled(K), side, side)
        renderer.rasterise(camera_T_base @ base_T_link)
        if renderer.dropped == 0 and (renderer.face >= 0).mean() > _LEAST_COVER:
            return Scene(arm, joints_rad, base_T_link, camera_T_base, K, size, renderer)


def random_posture(arm: Arm, rng: Rng) -> tuple[Array, Array]:
    """Joints (J,) rad within their limits, above the floor, and root_T_link (L, 4, 4)."""
    limits = np.clip(arm.model.limits(), -np.pi, np.pi)
    foot = len({k.link for k in arm.keypoints[:2]}) + 1
    for _ in range(_TRIES):
        q = rng.uniform(limits[:, 0], limits[:, 1])
        if rng.random() < TAUGHT:
            right = np.round(q / (np.pi / 2)) * np.pi / 2 + rng.normal(0, TAUGHT_NOISE_RAD, len(q))
            q = np.clip(right, limits[:, 0], limits[:, 1])
        root_T_link = arm.model.link_poses(q)
        points = arm.keypoint_positions(root_T_link)
        if points[foot:, 2].min(initial=np.inf) > LOWEST_M and _closest(points) > APART_M:
            break
    return q, np.asarray(root_T_link)


def _closest(points: Array) -> float:
    """The least distance m between keypoints (K, 3) that two others or more lie between."""
    first, second = np.triu_indices(len(points), 3)
    return float(np.linalg.norm(points[first] - points[second], axis=1).min(initial=np.inf))


def random_camera(points: Array, size: int, rng: Rng) -> tuple[Array, Array]:
    """camera_T_base (4, 4) and K (3, 3) of a picture of `size` px in which points (K, 3) m take a random share."""
    centre = points.mean(0) + rng.normal(0, 0.05, 3)
    distance = np.linalg.norm(points - centre, axis=1).max() + np.exp(rng.uniform(*np.log(DISTANCE_M)))
    azimuth = rng.uniform(-np.pi, np.pi)
    elevation = np.deg2rad(rng.uniform(*USUAL_DEG) if rng.random() < USUAL else rng.uniform(*ALL_DEG))
    level = np.array([np.cos(azimuth), np.sin(azimuth), 0])
    eye = centre + distance * (np.cos(elevation) * level + [0, 0, np.sin(elevation)])
    forward = (centre - eye) / distance
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    roll = np.deg2rad(np.clip(rng.normal(0, 10), -35, 35))
    R = se3.so3_exp(np.array([0, 0, roll])) @ np.stack([right, np.cross(forward, right), forward])
    camera_T_base = se3.make(R, -R @ eye)
    p = points @ R.T + camera_T_base[:3, 3]
    low, high = (p[:, :2] / p[:, 2:]).min(0), (p[:, :2] / p[:, 2:]).max(0)
    low, high = low - LINK_RADIUS_M / distance, high + LINK_RADIUS_M / distance
    focal = size * np.exp(rng.uniform(*np.log(_SHARE))) / (high - low).max()
    place = rng.uniform(-0.08, 1.08, 2) if rng.random() < 0.6 else np.full(2, 0.5)
    corner = place * (size - focal * (high - low))
    if rng.random() < 0.15:
        corner += rng.uniform(-0.3, 0.3, 2) * size
    c = corner - focal * low
    K = np.array([[focal, 0, c[0]], [0, focal * rng.uniform(0.99, 1.01), c[1]], [0, 0, 1]])
    return camera_T_base, K
