"""The suite `synthetic`: rendered UR5e recordings with truth, for the methods that look at the robot itself.

One item, in this order of draws from ``default_rng([seed, crc32(start level), index])``:

1. Camera 640 x 480, f = 640 px, principal point in the middle, no distortion. It stands at (2, 0, 0.35) m of
   `base_link` and looks at (0.2, 0, 0.35) m, both points off by a uniform draw within 0.05 m per axis, and is
   rolled about its view axis by a uniform draw within 5 deg.
2. For each view, joints (0, -90, 90, -90, -90, 0) deg, each plus a uniform draw within 10 deg.
3. The start: camera_T_base with each translation coordinate off by LP 0-0.1, MP 0.1-0.2, HP 0.2-0.3 m, the sign
   at random, and its rotation left-multiplied by xyz Euler angles uniform within 10 deg (it turns about the
   base's origin).

The picture is the unlit robot on black, 8 bit; the mask is where it covers half a pixel or more. The levels
`mismatch_1`, `_3`, `_5` draw a robot scaled by diag(1 + s g) in the base frame, g three standard normal numbers
and s 1, 3, 5 %, in the scenes and from the starts of LP, so that they are paired. The other levels change one
thing each about LP, see `CHANGES`.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.recording import CameraModel, Mounting, Recording, RobotDescription
from hecbench.registry import hookimpl
from hecbench.robots.model import RobotModel, load_robot
from hecbench.se3 import Array
from hecbench.specs import SuiteSpec

if TYPE_CHECKING:
    from hecbench.rendering import RenderMesh

Picture = NDArray[np.float32]

ROBOT, BASE, FLANGE = "ur5e", "base_link", "tool0"
WIDTH, HEIGHT, FOCAL_PX = 640, 480, 640.0
CENTRE_JOINTS_DEG = (0, -90, 90, -90, -90, 0)
START_RANGES_M = {"LP": (0.0, 0.1), "MP": (0.1, 0.2), "HP": (0.2, 0.3)}
MISMATCH = {"mismatch_1": 0.01, "mismatch_3": 0.03, "mismatch_5": 0.05}
VIEWS = {"views_3": 3, "views_5": 5}


@dataclass(frozen=True, eq=False)
class Scene:
    """What was drawn: the truth of one item."""

    camera: CameraModel
    camera_T_base: Array
    start_camera_T_base: Array
    joints_rad: Array
    """(views, 6)"""
    scale: Array
    """(3,) of the drawn robot in the base frame."""


Change = Callable[[Picture, np.random.Generator], Picture]
"""From a picture (H, W, 4) in [0, 1], RGB and mask, to another."""


def _colours(change: Callable[[Picture], Picture]) -> Change:
    def apply(picture: Picture, rng: np.random.Generator) -> Picture:
        return np.concatenate([np.clip(change(picture[..., :3]), 0, 1), picture[..., 3:]], -1)

    return apply


def _unchanged(picture: Picture, rng: np.random.Generator) -> Picture:
    return picture


def _noise(picture: Picture, rng: np.random.Generator) -> Picture:
    noisy = picture[..., :3] + rng.normal(0, 0.05, picture[..., :3].shape).astype(np.float32)
    return np.concatenate([np.clip(noisy, 0, 1), picture[..., 3:]], -1)


def _blurred(rgb: Picture) -> Picture:
    from scipy import ndimage

    return np.asarray(ndimage.gaussian_filter(rgb, (1, 1, 0)))


def _ragged_mask(picture: Picture, rng: np.random.Generator) -> Picture:
    from scipy import ndimage

    width, grow = int(rng.integers(1, 4)), bool(rng.integers(2))
    change = ndimage.binary_dilation if grow else ndimage.binary_erosion
    mask = change(picture[..., 3] >= 0.5, iterations=width)
    return np.concatenate([picture[..., :3], mask[..., None].astype(np.float32)], -1)


def _occluded(picture: Picture, rng: np.random.Generator) -> Picture:
    """A grey upright bar over a fifth of the robot's pixels, also cut out of the mask."""
    rows, columns = np.nonzero(picture[..., 3] >= 0.5)
    order = np.sort(rows)
    first = int(rng.integers(0, int(0.8 * len(order))))
    top, bottom = order[first], order[min(first + len(order) // 5, len(order) - 1)]
    changed = picture.copy()
    changed[top : bottom + 1, columns.min() - 5 : columns.max() + 6] = (0.5, 0.5, 0.5, 0)
    return changed


CHANGES: dict[str, Change] = {
    "gain": _colours(lambda rgb: 1.2 * rgb),
    "gamma": _colours(lambda rgb: rgb**0.7),
    "blur": _colours(_blurred),
    "noise": _noise,
    "ragged_mask": _ragged_mask,
    "occlusion": _occluded,
}
"""Levels that change the picture: gain 1.2, gamma 0.7, blur of 1 px, noise of sigma 0.05, a mask 1-3 px too large
or too small, a fifth of the robot hidden."""

LEVELS = (*START_RANGES_M, *MISMATCH, *CHANGES, "colours", "joint_noise", *VIEWS)
"""`colours`: every part in a colour of its own, uniform in [0, 1]; `joint_noise`: recorded joints off by 0.1 deg."""


@lru_cache(maxsize=1)
def robot_and_mesh() -> tuple[RobotModel, RenderMesh]:
    """The robot that the suite draws."""
    from hecbench.rendering import RenderMesh

    model = load_robot(ROBOT)
    return model, RenderMesh.of(model)


def scene(level: str, index: int, seed: int) -> Scene:
    """What `make` draws; see the module's docstring."""
    from scipy.spatial.transform import Rotation

    start_level = level if level in START_RANGES_M else "LP"
    rng = np.random.default_rng([seed, zlib.crc32(start_level.encode()), index])
    K = np.array([[FOCAL_PX, 0, (WIDTH - 1) / 2], [0, FOCAL_PX, (HEIGHT - 1) / 2], [0, 0, 1]])
    eye = np.array([2.0, 0, 0.35]) + rng.uniform(-0.05, 0.05, 3)
    target = np.array([0.2, 0, 0.35]) + rng.uniform(-0.05, 0.05, 3)
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    roll = se3.so3_exp([0, 0, np.deg2rad(rng.uniform(-5, 5))])
    camera_R_base = roll @ np.stack([right, np.cross(forward, right), forward])
    camera_T_base = se3.make(camera_R_base, -camera_R_base @ eye)
    joints = np.deg2rad(CENTRE_JOINTS_DEG + rng.uniform(-10, 10, (5, 6)))[: VIEWS.get(level, 1)]
    low, high = START_RANGES_M[start_level]
    offset = rng.uniform(low, high, 3) * rng.choice([-1, 1], 3)
    turn = Rotation.from_euler("xyz", rng.uniform(-np.pi / 18, np.pi / 18, 3)).as_matrix()
    start = se3.make(turn @ camera_R_base, camera_T_base[:3, 3] + offset)
    scale = 1 + MISMATCH.get(level, 0.0) * rng.normal(size=3)
    return Scene(CameraModel(WIDTH, HEIGHT, K), camera_T_base, start, joints, scale)


def make(level: str, index: int, seed: int) -> Recording:
    """One item; it depends on nothing but the three numbers."""
    from hecbench.rendering import Renderer

    truth = scene(level, index, seed)
    model, mesh = robot_and_mesh()
    rng = np.random.default_rng([seed, zlib.crc32(level.encode()), index, 1])
    colours = rng.uniform(0, 1, mesh.colours.shape) if level == "colours" else mesh.colours
    change = CHANGES.get(level, _unchanged)
    images, masks = [], []
    for base_T_link in model.link_poses(truth.joints_rad, frame=BASE):
        drawn = mesh if level not in MISMATCH else mesh.scaled(base_T_link, truth.scale)
        renderer = Renderer(drawn, truth.camera.intrinsics, WIDTH, HEIGHT)
        renderer.draw(truth.camera_T_base @ base_T_link)
        picture = change(renderer.image(colours).copy(), rng)
        images.append(np.round(255 * np.clip(picture[..., :3], 0, 1)).astype(np.uint8))
        masks.append(np.where(picture[..., 3] >= 0.5, 255, 0).astype(np.uint8))
    joint_noise = rng.normal(0, np.deg2rad(0.1), truth.joints_rad.shape) if level == "joint_noise" else 0.0
    joints = truth.joints_rad + joint_noise
    return Recording(
        name=f"synthetic_{level}_{index:03d}",
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=tuple(f"{view:06d}" for view in range(len(images))),
        robot=RobotDescription(
            model=ROBOT, base_link=BASE, flange_link=FLANGE, joint_names=model.joint_names
        ),
        camera=truth.camera,
        initial_parent_T_camera=se3.inverse(truth.start_camera_T_base),
        truth_parent_T_camera=se3.inverse(truth.camera_T_base),
        base_T_flange=model.forward(joints, base=BASE, tip=FLANGE),
        joints_rad=joints,
        images=tuple(images),
        masks=tuple(masks),
    )


def correspondence_floor_mm(level: str, index: int, seed: int) -> float:
    """camera_T_base translation error of the best camera for exact point correspondences under the mismatch.

    Every visible point of the drawn robot is matched with the same point of the model; the camera minimises the
    reprojection error by Gauss-Newton. What is left cannot be seen in the picture: no method is held to less.
    """
    from hecbench.rendering import Renderer

    truth = scene(level, index, seed)
    model, mesh = robot_and_mesh()
    base_T_link = model.link_poses(truth.joints_rad, frame=BASE)[0]
    K = truth.camera.intrinsics
    renderer = Renderer(mesh.scaled(base_T_link, truth.scale), K, WIDTH, HEIGHT)
    renderer.draw(truth.camera_T_base @ base_T_link)
    v, u = np.nonzero(renderer.face >= 0)
    rays = np.stack([u, v, np.ones(len(u))], -1) @ np.linalg.inv(K).T
    drawn = se3.transform_points(se3.inverse(truth.camera_T_base), rays * renderer.depth[v, u, None])
    pose = truth.camera_T_base
    for _ in range(10):
        point = se3.transform_points(pose, drawn / truth.scale)
        residual = FOCAL_PX * (point[:, :2] / point[:, 2:] - rays[:, :2])
        gradient = np.zeros((len(point), 2, 3))
        gradient[:, 0, 0] = gradient[:, 1, 1] = FOCAL_PX / point[:, 2]
        gradient[:, :, 2] = -FOCAL_PX * point[:, :2] / point[:, 2:] ** 2
        columns = np.concatenate([np.cross(point[:, None], gradient), gradient], -1).reshape(-1, 6)
        pose = se3.exp(np.linalg.lstsq(columns, -residual.reshape(-1), rcond=None)[0]) @ pose
    return float(1e3 * np.linalg.norm(pose[:3, 3] - truth.camera_T_base[:3, 3]))


def facts(level: str, index: int, seed: int) -> dict[str, float]:
    """The irreducible floor of an item whose robot has wrong geometry."""
    if level not in MISMATCH:
        return {}
    return {"correspondence_floor_mm": correspondence_floor_mm(level, index, seed)}


@hookimpl
def hecbench_suites() -> Iterable[SuiteSpec]:
    yield SuiteSpec(
        name="synthetic",
        summary="rendered UR5e, one fixed camera: starts LP, MP, HP, wrong geometry, changed appearance, more views",
        levels=LEVELS,
        default_samples=200,
        make=make,
        facts=facts,
    )
