"""Generated marker recordings with truth, and the suite `markers` of three settings in both mountings.

How a recording is made, in this order of draws from ``default_rng([seed, crc32(level), index])``:

1. The camera is ideal (no distortion): principal point ((width - 1) / 2, (height - 1) / 2), fx = fy =
`focal_px`. 2. X = parent_T_camera. eye_to_hand: the camera looks at the workspace centre (0.5, 0, 0.3) m of
the base from
   `distance_m`, azimuth uniform within 60 deg of the base's x axis, elevation uniform in 0 to 45 deg, image x
   axis horizontal, then rolled about its view axis uniformly by up to 30 deg. eye_in_hand: uniform random
   rotation, each translation coordinate uniform within 0.1 m.
3. Y = carrier_T_target. eye_to_hand: uniform random rotation, translation `tag_offset_m` in the flange frame.
   eye_in_hand: uniform random rotation, translation (0.5, 0, 0.3) m.
4. For each sample, camera_T_target: a rotation vector with coordinates uniform within `rotation_deg`, and the
   translation (0, 0, `distance_m`) plus an offset uniform in a cube of side `box_m`, camera axes. At zero
   rotation the target faces the camera upright. The hand pose follows from X and Y, and so base_T_flange.
5. Corners: the projected target points plus Gaussian noise of `pixel_noise_px` per axis; a point outside the
image
   is not seen. Robot: the recorded pose is ``base_T_flange @ from_rotvec(w, t)`` with Gaussian w of
   `robot_noise_deg` and t of `robot_noise_mm` per axis, both in the flange frame.

The settings A, B and C of the method comparison are the levels tag_2m, small_tag_2m and board_2m: a 2448 x
2048 camera with f = 2464 px (Basler acA2440 with an 8.5 mm lens) 2 m away and 10 samples.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from hecbench import se3
from hecbench.recording import CameraModel, Mounting, Recording
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import SuiteSpec
from hecbench.targets import AprilTagTarget, ChessboardTarget, Target

WORKSPACE_CENTRE_M = np.array([0.5, 0.0, 0.3])


@dataclass(frozen=True)
class MarkerSetting:
    """What decides how hard a recording is; the module's docstring says how each number is used."""

    target: Target
    samples: int = 10
    mounting: Mounting = Mounting.EYE_TO_HAND
    distance_m: float = 2.0
    box_m: float = 0.5
    rotation_deg: float = 30.0
    pixel_noise_px: float = 0.3
    robot_noise_mm: float = 0.5
    robot_noise_deg: float = 0.05
    tag_offset_m: tuple[float, float, float] = (0.0, 0.0, 0.05)
    width: int = 2448
    height: int = 2048
    focal_px: float = 2464.0


_EYE_TO_HAND = {
    "tag_2m": MarkerSetting(AprilTagTarget("tag36h11", 0, 0.12)),
    "small_tag_2m": MarkerSetting(
        AprilTagTarget("tag36h11", 0, 0.05),
        box_m=0.3,
        rotation_deg=15.0,
        pixel_noise_px=0.5,
        robot_noise_mm=1.0,
        robot_noise_deg=0.1,
    ),
    "board_2m": MarkerSetting(ChessboardTarget(7, 5, 0.03), pixel_noise_px=0.2),
}
PRESETS = _EYE_TO_HAND | {
    f"{level}_in_hand": replace(setting, mounting=Mounting.EYE_IN_HAND)
    for level, setting in _EYE_TO_HAND.items()
}
"""Levels of the suite `markers`: three settings eye_to_hand, and the same eye_in_hand."""


def make(level: str, index: int, seed: int) -> Recording:
    """The `index`-th recording of a level; equal arguments give equal bytes."""
    rng = np.random.default_rng([seed, zlib.crc32(level.encode()), index])
    return generate(PRESETS[level], rng, name=f"{level}_{index:05d}")


def generate(setting: MarkerSetting, rng: np.random.Generator, name: str = "synthetic") -> Recording:
    """A recording of this setting; see the module's docstring."""
    camera = CameraModel.centred(setting.width, setting.height, setting.focal_px)
    centre = camera.intrinsics[:2, 2]
    eye_to_hand = setting.mounting is Mounting.EYE_TO_HAND
    if eye_to_hand:
        parent_T_camera = _camera_looking_at_workspace(setting.distance_m, rng)
        carrier_T_target = se3.make(_random_rotation(rng), setting.tag_offset_m)
    else:
        parent_T_camera = se3.make(_random_rotation(rng), rng.uniform(-0.1, 0.1, 3))
        carrier_T_target = se3.make(_random_rotation(rng), WORKSPACE_CENTRE_M)

    rotvecs = np.deg2rad(rng.uniform(-setting.rotation_deg, setting.rotation_deg, (setting.samples, 3)))
    offsets = rng.uniform(-setting.box_m / 2, setting.box_m / 2, (setting.samples, 3))
    camera_T_target = se3.from_rotvec(rotvecs, np.add(offsets, [0.0, 0.0, setting.distance_m]))
    hand = parent_T_camera @ camera_T_target @ se3.inverse(carrier_T_target)
    base_T_flange = hand if eye_to_hand else se3.inverse(hand)

    points_camera = se3.transform_points(camera_T_target, setting.target.points_m)
    corners_px = points_camera[..., :2] / points_camera[..., 2:] * setting.focal_px + centre
    corners_px += rng.normal(0.0, setting.pixel_noise_px, corners_px.shape)
    outside = (corners_px < -0.5) | (corners_px > [setting.width - 0.5, setting.height - 0.5])
    corners_px[outside.any(-1)] = np.nan

    shape = (setting.samples, 3)
    robot_rotvecs = np.deg2rad(rng.normal(0.0, setting.robot_noise_deg, shape))
    robot_noise = se3.from_rotvec(robot_rotvecs, rng.normal(0.0, setting.robot_noise_mm / 1e3, shape))
    return Recording(
        name=name,
        mounting=setting.mounting,
        sample_ids=tuple(f"{i:06d}" for i in range(setting.samples)),
        camera=camera,
        target=setting.target,
        truth_parent_T_camera=parent_T_camera,
        base_T_flange=base_T_flange @ robot_noise,
        corners_px=corners_px,
    )


def _camera_looking_at_workspace(distance_m: float, rng: np.random.Generator) -> Array:
    """base_T_camera (4, 4)."""
    azimuth, elevation = rng.uniform(-np.pi / 3, np.pi / 3), rng.uniform(0.0, np.pi / 4)
    away = np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )
    z = -away
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    upright = np.stack([x, np.cross(z, x), z], 1)
    roll = se3.so3_exp([0.0, 0.0, rng.uniform(-np.pi / 6, np.pi / 6)])
    return se3.make(upright @ roll, WORKSPACE_CENTRE_M + distance_m * away)


def _random_rotation(rng: np.random.Generator) -> Array:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.random(random_state=rng).as_matrix())


@hookimpl
def hecbench_suites() -> Iterable[SuiteSpec]:
    """This file's suite."""
    yield SuiteSpec(
        name="markers",
        summary="a tag or board 2 m from the camera, pixel and robot noise, with truth",
        levels=tuple(PRESETS),
        default_samples=200,
        make=make,
    )
