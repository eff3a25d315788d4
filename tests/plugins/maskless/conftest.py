"""Photographs drawn here: a robot with uneven light before a lively wall."""

import numpy as np
import pytest
from hecbench_plugins.views.pyramid import meshes_by_level
from scipy import ndimage

from hecbench import se3
from hecbench.recording import CameraModel, Mounting, Recording, RobotDescription
from hecbench.rendering import Renderer
from hecbench.robots.posed import cached_robot

CAMERA = CameraModel(480, 360, np.array([[480.0, 0, 239.5], [0, 480.0, 179.5], [0, 0, 1]]))
CENTRE_RAD = np.deg2rad([0, -90, 90, -90, -90, 0])


def looking(eye, target):
    """parent_T_camera at `eye` that looks at `target`."""
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    return se3.make(np.stack([right, np.cross(forward, right), forward], 1), eye)


def moved(pose, rng, metres, degrees):
    """A pose exactly so far off."""
    shift, axis = rng.normal(size=(2, 3))
    turn = se3.so3_exp(np.deg2rad(degrees) * axis / np.linalg.norm(axis))
    return se3.make(pose[:3, :3] @ turn, pose[:3, 3] + metres * shift / np.linalg.norm(shift))


def wall(rng):
    """(360, 480, 3) in [0, 1]: smooth coloured spots."""
    spots = ndimage.gaussian_filter(rng.normal(size=(360, 480, 3)), (14, 14, 0))
    return np.clip(0.45 + 0.2 * spots / spots.std(), 0, 1)


def photographs(mounting, views, seed=0):
    """A recording without masks; the start is 0.05 m and 5 deg off."""
    rng = np.random.default_rng(seed)
    model = cached_robot("ur3e")
    meshes = meshes_by_level(model)
    joints = CENTRE_RAD + rng.uniform(-0.6, 0.6, (views, 6))
    if mounting is Mounting.EYE_TO_HAND:
        parent, truth = "base_link", looking(np.array([1.1, 0.3, 0.5]), np.array([0.1, 0.0, 0.25]))
    else:
        parent, truth = "tool0", looking(np.array([0.5, 0.1, -0.7]), np.array([0.0, 0.0, -0.2]))
    renderer = Renderer(meshes[1], CAMERA.K, CAMERA.width, CAMERA.height)
    light = 0.75 + 0.25 * np.linspace(-1, 1, CAMERA.width)[None, :, None]
    behind = wall(rng)
    images = []
    for parent_T_link in model.link_poses(joints, frame=parent):
        if mounting is Mounting.EYE_IN_HAND:
            behind = wall(rng)
        renderer.draw(se3.inverse(truth) @ parent_T_link)
        drawn = renderer.image()
        picture = (1 - drawn[..., 3:]) * behind + light * drawn[..., :3]
        noisy = 255 * picture + rng.normal(0, 2, picture.shape)
        images.append(np.clip(np.round(noisy), 0, 255).astype(np.uint8))
    return Recording(
        name="photographs",
        mounting=mounting,
        sample_ids=tuple(str(view) for view in range(views)),
        robot=RobotDescription(model="ur3e", base_link="base_link", flange_link="tool0"),
        camera=CAMERA,
        joints_rad=joints,
        initial_parent_T_camera=moved(truth, rng, 0.05, 5.0),
        truth_parent_T_camera=truth,
        images=tuple(images),
    )


@pytest.fixture(scope="session")
def fixed_camera():
    """Four photographs of a camera beside the robot."""
    return photographs(Mounting.EYE_TO_HAND, 4)


@pytest.fixture(scope="session")
def camera_in_hand():
    """One photograph of its own arm by a camera on the flange."""
    return photographs(Mounting.EYE_IN_HAND, 1)
