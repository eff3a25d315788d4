"""The suite `guess_free`: rendered UR5e recordings with masks and truth, and no start.

One item of the level `free`, in this order of draws from ``default_rng([seed, crc32("free"), index])``, all of it
drawn again until the conditions hold:

1. Joints: pan and wrist 2 and 3 within 180 deg, lift -150 to -30, elbow within 140, wrist 1 -180 to 0 deg, with
   every link from the upper arm's end on and the flange 0.1 m or more above the mounting plane.
2. The camera of the suite `synthetic`, 1 to 3 m (uniform) from the middle of the robot's drawn vertices, in a
   direction uniform on the upper half of the sphere, rolled by a uniform draw within 30 deg about its optical axis
   from where the base's z points up in the image (from where its x does when the camera looks along z).
3. It looks beside the middle: at a point off by a uniform draw within 0.3 m per axis across the line of sight.

Conditions: 60 % or more of the robot's pixels, counted on a canvas of three times the width and height, lie in the
image, and no part of the robot reaches behind the near plane.

The levels `free_3` and `free_5` have as many views, the further joints drawn like the first, under the same
conditions. The picture is the unlit robot on black, the mask where it covers half a pixel or more.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from hecbench import se3
from hecbench.recording import CameraModel, Mounting, Recording, RobotDescription
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import SuiteSpec
from hecbench_datasets.suites.synthetic import BASE, FLANGE, FOCAL_PX, HEIGHT, ROBOT, WIDTH, robot_and_mesh

LEVELS = {"free": 1, "free_3": 3, "free_5": 5}
"""Views by level."""
DISTANCE_M = (1.0, 3.0)
ROLL_DEG, ASIDE_M, LEAST_IN_VIEW, LEAST_HEIGHT_M = 30.0, 0.3, 0.6, 0.1
JOINTS_LOW_DEG = (-180, -150, -140, -180, -180, -180)
JOINTS_HIGH_DEG = (180, -30, 140, 0, 180, 180)
_CANVAS = 3
_STRAIGHT_DOWN = 0.999


@dataclass(frozen=True, eq=False)
class Scene:
    """What was drawn: the truth of one item."""

    camera_T_base: Array
    joints_rad: Array
    """(views, 6)"""
    camera: CameraModel


def scene(level: str, index: int, seed: int) -> Scene:
    """What `make` draws; see the module's docstring."""
    from hecbench.rendering import Renderer

    _, mesh = robot_and_mesh()
    rng = np.random.default_rng([seed, zlib.crc32(level.encode()), index])
    camera = CameraModel(WIDTH, HEIGHT, _intrinsics(WIDTH, HEIGHT))
    wide = Renderer(mesh, _intrinsics(_CANVAS * WIDTH, _CANVAS * HEIGHT), _CANVAS * WIDTH, _CANVAS * HEIGHT)
    while True:
        joints = np.array([working_joints(rng) for _ in range(LEVELS[level])])
        camera_T_base = _camera(middle(joints[0]), rng)
        if all(share_in_view(wide, camera_T_base, view) >= LEAST_IN_VIEW for view in joints):
            return Scene(camera_T_base, joints, camera)


def middle(joints_rad: Array) -> Array:
    """The middle (3,) m of the box around the robot's vertices, base frame."""
    model, mesh = robot_and_mesh()
    points = []
    for link, base_T_link in enumerate(model.link_poses(joints_rad, frame=BASE)):
        own = mesh.vertices[:, mesh.vertex_start[link] : mesh.vertex_start[link + 1]].T.astype(float)
        points.append(se3.transform_points(base_T_link, own))
    corners = np.concatenate(points)
    return np.asarray((corners.min(0) + corners.max(0)) / 2)


def share_in_view(wide: object, camera_T_base: Array, joints_rad: Array) -> float:
    """Share of the robot's pixels on the wide canvas that lie in the image; 0 when it reaches behind the camera."""
    from hecbench.rendering import Renderer

    assert isinstance(wide, Renderer)
    model, _ = robot_and_mesh()
    wide.draw(camera_T_base @ model.link_poses(joints_rad, frame=BASE))
    drawn = wide.face >= 0
    if wide.dropped or not drawn.any():
        return 0.0
    top, left = (_CANVAS - 1) * HEIGHT // 2, (_CANVAS - 1) * WIDTH // 2
    return float(drawn[top : top + HEIGHT, left : left + WIDTH].sum() / drawn.sum())


def _intrinsics(width: int, height: int) -> Array:
    return CameraModel.centred(width, height, FOCAL_PX).intrinsics


def working_joints(rng: np.random.Generator) -> Array:
    """Joints (6,) drawn like those of the suite; see the module's docstring."""
    model, _ = robot_and_mesh()
    links = [model.link_index(name) for name in ("forearm_link", "wrist_1_link", "wrist_2_link", FLANGE)]
    while True:
        joints = np.deg2rad(rng.uniform(JOINTS_LOW_DEG, JOINTS_HIGH_DEG))
        if model.link_poses(joints, frame=BASE)[links, 2, 3].min() >= LEAST_HEIGHT_M:
            return np.asarray(joints)


def _camera(centre: Array, rng: np.random.Generator) -> Array:
    """camera_T_base of a camera beside whose line of sight the centre lies."""
    azimuth, height = rng.uniform(-np.pi, np.pi), rng.uniform(0, 1)
    outward = np.array(
        [np.cos(azimuth) * np.sqrt(1 - height**2), np.sin(azimuth) * np.sqrt(1 - height**2), height]
    )
    eye = centre + rng.uniform(*DISTANCE_M) * outward
    roll = se3.so3_exp([0, 0, np.deg2rad(rng.uniform(-ROLL_DEG, ROLL_DEG))])
    level = _level(-outward)
    target = centre + level[:2].T @ rng.uniform(-ASIDE_M, ASIDE_M, 2)
    camera_R_base = roll @ _level((target - eye) / np.linalg.norm(target - eye))
    return se3.make(camera_R_base, -camera_R_base @ eye)


def _level(forward: Array) -> Array:
    """camera_R_base (3, 3) of a camera that looks forward with the base's z (or x) up in the image."""
    up = [0, 0, 1] if abs(forward[2]) < _STRAIGHT_DOWN else [1, 0, 0]
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


def make(level: str, index: int, seed: int) -> Recording:
    """One item; it depends on nothing but the three values."""
    from hecbench.rendering import Renderer

    truth = scene(level, index, seed)
    model, mesh = robot_and_mesh()
    renderer = Renderer(mesh, truth.camera.intrinsics, WIDTH, HEIGHT)
    images, masks = [], []
    for base_T_link in model.link_poses(truth.joints_rad, frame=BASE):
        renderer.draw(truth.camera_T_base @ base_T_link)
        picture = renderer.image()
        images.append(np.round(255 * np.clip(picture[..., :3], 0, 1)).astype(np.uint8))
        masks.append(np.where(picture[..., 3] >= 0.5, 255, 0).astype(np.uint8))
    return Recording(
        name=f"guess_free_{level}_{index:03d}",
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=tuple(f"{view:06d}" for view in range(len(images))),
        robot=RobotDescription(
            model=ROBOT, base_link=BASE, flange_link=FLANGE, joint_names=model.joint_names
        ),
        camera=truth.camera,
        truth_parent_T_camera=se3.inverse(truth.camera_T_base),
        base_T_flange=model.forward(truth.joints_rad, base=BASE, tip=FLANGE),
        joints_rad=truth.joints_rad,
        images=tuple(images),
        masks=tuple(masks),
    )


@hookimpl
def hecbench_suites() -> Iterable[SuiteSpec]:
    yield SuiteSpec(
        name="guess_free",
        summary="rendered UR5e with masks and no start: a camera anywhere on the upper view sphere, 1 to 3 m away",
        levels=tuple(LEVELS),
        default_samples=200,
        make=make,
        solvers=lambda level: ("render_gn_free",),
    )
