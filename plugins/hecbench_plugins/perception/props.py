"""What stands around an arm and what it holds: floor with its shadow, gripper, board, cable."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.rendering import Renderer, RenderMesh
from hecbench.robots.model import RobotModel, load_robot
from hecbench.se3 import Array
from hecbench_plugins.perception.appearance import Appearance
from hecbench_plugins.perception.scene import Scene

Floats = NDArray[np.float32]
Mask = NDArray[np.bool_]

_GRIPPER_ARM = "ur5e"
_MERGE_M = 0.003
"""Vertices of the gripper nearer than this are one: it is small in every picture."""
_TILE_PX = 512
_NEAR_M, _FAR_M = 0.02, 20.0


@dataclass(eq=False)
class Canvas:
    """The drawing so far: `picture` (S, S, 3), what of the robot is still `visible`, and how near, 1/m."""

    picture: Floats
    visible: Mask
    nearness: Floats
    camera_T_flange: Array
    """The last link that has a mesh."""

    def paint(self, where: Mask, colours: Floats) -> None:
        """Put colours (N, 3) before everything at the N pixels of `where`."""
        self.picture[where] = colours
        self.visible &= ~where

    def in_front(self, nearness: Floats) -> Mask:
        """Where something at this nearness (S, S) hides the robot or stands before the background."""
        return np.asarray(nearness > np.where(self.visible, self.nearness, 0))


@cache
def gripper() -> tuple[RobotModel, RenderMesh]:
    """The known gripper alone; its root is the flange."""
    whole = load_robot(f"{_GRIPPER_ARM}+robotiq_2f_85")
    arm = load_robot(_GRIPPER_ARM)
    model = whole.without([part.name for part in arm.parts])
    return model, RenderMesh.of(model, cell_m=_MERGE_M)


def viewing_rays(K: Array, size: int) -> Floats:
    """(size, size, 2): x / z and y / z of every pixel centre."""
    grid = np.arange(size, dtype=np.float32)
    x, y = (grid - K[0, 2]) / K[0, 0], (grid - K[1, 2]) / K[1, 1]
    return np.stack(np.meshgrid(x, y), -1).astype(np.float32)


def lay_floor(canvas: Canvas, scene: Scene, appearance: Appearance) -> None:
    """A table or floor at the foot or below it, with the arm's shadow; the robot stays before it."""
    rng, side = appearance.rng, canvas.picture.shape[:2][::-1]
    base_T_camera = se3.inverse(scene.camera_T_base)
    height = 0.0 if rng.random() < 0.85 else rng.uniform(-0.8, -0.1)
    if base_T_camera[2, 3] < height + 0.05:
        return
    across = base_T_camera[:3, :2].T.astype(np.float32)
    rays = viewing_rays(scene.K, scene.size) @ across + base_T_camera[:3, 2].astype(np.float32)
    with np.errstate(all="ignore"):
        depth = np.float32(height - base_T_camera[2, 3]) / rays[..., 2]
        ground = rays[..., :2] * np.clip(depth, 0, _FAR_M)[..., None] + base_T_camera[:2, 3].astype(
            np.float32
        )
        nearness = np.where(depth > _NEAR_M, 1 / np.maximum(depth, _NEAR_M), 0).astype(np.float32)
    on, colours = _tiles(ground, appearance)
    on &= (depth > _NEAR_M) & (depth < _FAR_M)
    if rng.random() < 0.65:
        colours *= (1 - rng.uniform(0.2, 0.75) * _shadow(scene, height, rng))[..., None].astype(np.float32)
    on = cv2.resize(on.astype(np.float32), side) > 0.5
    hides = on & (cv2.resize(nearness, side) > canvas.nearness + 1e-6)
    canvas.picture[on] = cv2.resize(colours, side)[on]
    canvas.visible &= ~hides


def _tiles(ground: Floats, appearance: Appearance) -> tuple[Mask, Floats]:
    """Where a table of random place and size is, and its texture."""
    rng = appearance.rng
    half = rng.uniform(0.15, 1.2, 2) if rng.random() < 0.6 else np.full(2, 5.0)
    turn = rng.uniform(0, 2 * np.pi)
    axes = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]], np.float32)
    place = (ground - (rng.uniform(-0.5, 0.5, 2) * np.minimum(half, 1)).astype(np.float32)) @ axes
    scale = np.float32(_TILE_PX / max(2 * min(half.max(), rng.uniform(0.5, 3)), 0.1))
    texture = np.ascontiguousarray(appearance.texture(_TILE_PX, _TILE_PX))
    with np.errstate(all="ignore"):
        u, v = ((place[..., axis] * scale) % _TILE_PX for axis in (0, 1))
    colours = cv2.remap(texture, u, v, cv2.INTER_LINEAR)
    return np.asarray((np.abs(place) < half).all(2)), np.asarray(colours, np.float32)


def _shadow(scene: Scene, height: float, rng: np.random.Generator) -> Floats:
    """How much of a lamp's light the arm keeps from the floor at `height`, (size, size), blurred."""
    lamp = rng.normal((0, 0, -1.2), 0.6)
    lamp[2] = min(lamp[2], -0.35)
    flattened = np.eye(4)
    flattened[:2, 2], flattened[2, 2:] = -lamp[:2] / lamp[2], (0, height)
    flattened[:2, 3] = height * lamp[:2] / lamp[2]
    renderer = Renderer(scene.arm.mesh, scene.K, scene.size, scene.size)
    renderer.rasterise(scene.camera_T_base @ flattened @ scene.base_T_link)
    seen = (renderer.face >= 0).astype(np.float32)
    return np.asarray(cv2.GaussianBlur(seen, (0, 0), rng.uniform(0.4, 3)), np.float32)


def hold_gripper(canvas: Canvas, scene: Scene, rng: np.random.Generator) -> None:
    """The known gripper at the flange, in other greys."""
    model, mesh = gripper()
    tool_T_link = model.link_poses(_closed(model, rng.uniform(0, 0.7)), frame="tool0")
    side = len(canvas.picture)
    renderer = Renderer(mesh, scene.fine_K, side, side)
    renderer.rasterise(canvas.camera_T_flange @ tool_T_link)
    front = canvas.in_front(renderer.nearness) & (renderer.face >= 0)
    face = renderer.face[front]
    colours = mesh.colours * rng.uniform(0.5, 2) + rng.normal(0, 0.05, mesh.colours.shape)
    facing = 0.6 + 0.5 * np.abs(mesh.planes[2][face])
    canvas.paint(front, (colours[mesh.face_part[face]] * facing[:, None]).astype(np.float32))


def _closed(model: RobotModel, opening: float) -> Array:
    """Joint positions with the fingers at `opening` rad and the arm at zero."""
    return np.array([opening if name.startswith("gripper/") else 0.0 for name in model.joint_names])


def hold_board(canvas: Canvas, scene: Scene, appearance: Appearance) -> None:
    """A board, plate or box lid near the flange, half of the time square to it."""
    rng = appearance.rng
    half = rng.uniform(0.03, 0.18, 2)
    axis = rng.normal(0, 1, 3)
    turn = (
        axis / np.linalg.norm(axis) * rng.uniform(0, np.pi) if rng.random() < 0.5 else rng.normal(0, 0.05, 3)
    )
    shift = rng.normal((0, 0, rng.uniform(0, 0.1)), 0.05)
    pose = canvas.camera_T_flange @ se3.from_rotvec(turn, shift)
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * [*half, 0]
    corners = se3.transform_points(pose, corners)
    if corners[:, 2].min() < 0.1:
        return
    K, side = scene.fine_K, len(canvas.picture)
    pixels = (corners[:, :2] / corners[:, 2:] * [K[0, 0], K[1, 1]] + K[:2, 2]).astype(np.float32)
    texture = np.ascontiguousarray(appearance.board() * np.float32(rng.uniform(0.6, 1.1)))
    n = len(texture)
    H = cv2.getPerspectiveTransform(np.array([[0, 0], [n, 0], [n, n], [0, n]], np.float32), pixels)
    inside = cv2.warpPerspective(np.full((n, n), 255, np.uint8), H, (side, side)) > 127
    normal = pose[:3, 2].astype(np.float32)
    rays = viewing_rays(K, side)
    nearness = (rays @ normal[:2] + normal[2]) / np.float32(normal @ pose[:3, 3] or 1e-9)
    front = inside & canvas.in_front(nearness)
    canvas.paint(front, cv2.warpPerspective(texture, H, (side, side), flags=cv2.INTER_LINEAR)[front])


def hang_cable(canvas: Canvas, scene: Scene, appearance: Appearance) -> None:
    """A cable along the arm, so thin that the robot stays visible."""
    rng = appearance.rng
    points = scene.arm.keypoint_positions(scene.camera_T_link)
    chosen = np.sort(rng.permutation(len(points))[: rng.integers(2, 5)])
    p = points[chosen] + rng.normal(0, 0.06, (len(chosen), 3))
    K = scene.fine_K
    pixels = p[:, :2] / np.maximum(p[:, 2:], 0.1) * [K[0, 0], K[1, 1]] + K[:2, 2]
    along, knots = np.linspace(0, 1, 30), np.linspace(0, 1, len(chosen))
    curve = np.stack([np.interp(along, knots, pixels[:, axis]) for axis in (0, 1)], 1)
    curve = np.clip(cv2.GaussianBlur(curve, (1, 9), 3), -2000, 3000)
    thickness = int(rng.integers(1, 7))
    cv2.polylines(
        canvas.picture,
        [np.rint(curve).astype(np.int32)],
        False,
        appearance.colour().tolist(),
        thickness,
        cv2.LINE_AA,
    )
