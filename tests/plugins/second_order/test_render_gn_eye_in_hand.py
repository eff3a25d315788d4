"""A camera on the flange that sees a second arm of known base, or part of the arm that carries it."""

import numpy as np
import pytest
from hecbench_plugins.solvers.render_gn import render_gn

from hecbench import se3
from hecbench.recording import CameraModel, Mounting, Recording, RobotDescription
from hecbench.rendering import Renderer, RenderMesh
from hecbench.robots.model import load_robot
from hecbench.robots.writer import write_urdf

CAMERA = CameraModel(640, 480, np.array([[500.0, 0, 319.5], [0, 500, 239.5], [0, 0, 1]]))
BASE_T_OTHER = se3.exp([0, 0, np.pi, 0, 0, 0])
BASE_T_OTHER[:3, 3] = [1.15, 0.15, 0.05]


def looking(eye, at):
    """base_T_camera (4, 4) of a camera at `eye` m that looks `at` a point, upright."""
    forward = np.subtract(at, eye) / np.linalg.norm(np.subtract(at, eye))
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    return se3.make(np.stack([right, np.cross(forward, right), forward], 1), eye)


def recording(model, name, flange_T_camera, joints_rad, off, robot):
    """What the camera on the flange sees of the model, and a start `off` (6,) from the truth."""
    images, masks = [], []
    renderer = Renderer(RenderMesh.of(model), CAMERA.K, CAMERA.width, CAMERA.height)
    for flange_T_link in model.link_poses(joints_rad, frame="tool0"):
        renderer.draw(se3.inverse(flange_T_camera) @ flange_T_link)
        picture = renderer.image()
        images.append(np.round(255 * picture[..., :3]).astype(np.uint8))
        masks.append(np.where(picture[..., 3] >= 0.5, 255, 0).astype(np.uint8))
    return Recording(
        name=name,
        mounting=Mounting.EYE_IN_HAND,
        sample_ids=tuple(f"{index:06d}" for index in range(len(images))),
        robot=robot,
        camera=CAMERA,
        initial_parent_T_camera=flange_T_camera @ se3.exp(off),
        truth_parent_T_camera=flange_T_camera,
        base_T_flange=model.forward(joints_rad, base="base_link", tip="tool0"),
        joints_rad=joints_rad,
        images=tuple(images),
        masks=tuple(masks),
    )


def solve(given):
    estimate = render_gn()(given.without_truth(), rng=np.random.default_rng(0))
    ends = estimate.parent_T_camera, given.truth_parent_T_camera
    assert estimate.diagnostics["overlap"] > 0.97
    return se3.translation_error_m(*ends), se3.rotation_error_rad(*ends)


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """Two arms on one table, as a URDF that a recording can name."""
    arm, path = load_robot("ur3e"), tmp_path_factory.mktemp("pair") / "pair.urdf"
    write_urdf(arm.with_tool(arm, "base_link", "other/", BASE_T_OTHER), path)
    return load_robot(path), path


def test_sees_a_second_arm_of_known_base(pair):
    model, path = pair
    rng = np.random.default_rng(0)
    own, other = np.deg2rad([0, -120, 120, 0, 90, 0]), np.deg2rad([0, -90, 90, -90, -90, 0])
    joints = np.r_[own, other] + rng.uniform(-0.1, 0.1, (2, 12))
    names = [*load_robot("ur3e", meshes=False).joint_names]
    names += [f"other/{name}" for name in names]
    order = [names.index(name) for name in model.joint_names]
    flange_T_camera = se3.exp([0.1, -0.05, 0.2, 0.02, -0.08, 0.03])
    robot = RobotDescription(
        urdf=path, base_link="base_link", flange_link="tool0", joint_names=model.joint_names
    )
    off = np.array([0.06, -0.08, 0.05, 0.05, -0.04, 0.06])
    given = recording(model, "second_arm", flange_T_camera, joints[:, order], off, robot)
    assert all(2000 < (given.mask(index) > 0).sum() < 100_000 for index in range(2))
    translation_m, rotation_rad = solve(given)
    assert translation_m < 1e-3
    assert rotation_rad < 1e-3


def test_sees_part_of_its_own_robot():
    """A camera on a bracket at the flange, looking back at shoulder and elbow; the base is out of the picture."""
    model = load_robot("ur3e")
    joints = np.deg2rad([[0, -90, 90, -90, -90, 0], [10, -80, 80, -100, -80, 15]])
    base_T_flange = model.forward(joints[0], base="base_link", tip="tool0")
    flange_T_camera = se3.inverse(base_T_flange) @ looking([0.25, 0.42, 0.42], [0.05, 0.1, 0.3])
    robot = RobotDescription(
        model="ur3e", base_link="base_link", flange_link="tool0", joint_names=model.joint_names
    )
    given = recording(
        model, "own_arm", flange_T_camera, joints, np.array([0.04, -0.05, 0.04, 0.02, -0.02, 0.03]), robot
    )
    assert given.mask(0)[[0, -1]].any() or given.mask(0)[:, [0, -1]].any()
    translation_m, rotation_rad = solve(given)
    assert translation_m < 1e-3
    assert rotation_rad < 1e-3
