"""render_gn without a start: the view sphere, the search by masks, and recordings that do not determine the camera."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hecbench_datasets.suites import guess_free as suite
from hecbench_plugins.solvers.render_gn_free import render_gn_free
from hecbench_plugins.start_search.view_sphere import ViewSphere, best_apart, look_at

from hecbench import se3
from hecbench.errors import Refusal, SolverFailure
from hecbench.recording import CameraModel, Mounting, Recording, RobotDescription
from hecbench.rendering import Renderer, RenderMesh
from hecbench.robots.model import load_robot

BOX_URDF = """<robot name="box">
  <link name="base"><visual><geometry><mesh filename="foot.obj"/></geometry></visual></link>
  <link name="head"><visual><geometry><mesh filename="head.obj"/></geometry></visual></link>
  <joint name="lift" type="prismatic"><parent link="base"/><child link="head"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/></joint>
</robot>"""


def solve(recording):
    return render_gn_free()(recording.without_truth(), rng=np.random.default_rng(0))


def test_the_sphere_is_covered_as_densely_as_asked():
    sphere = ViewSphere(spacing_deg=15.0)
    directions = sphere.directions()
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1)
    assert directions[:, 2].min() > np.sin(np.deg2rad(sphere.lowest_deg)) - 1e-9
    rng = np.random.default_rng(0)
    asked = rng.normal(size=(500, 3))
    asked /= np.linalg.norm(asked, axis=1)[:, None]
    asked[:, 2] = np.abs(asked[:, 2])
    nearest_deg = np.degrees(np.arccos(np.clip(asked @ directions.T, -1, 1).max(1)))
    assert nearest_deg.max() < sphere.spacing_deg


def test_cameras_look_where_they_should():
    rotations = ViewSphere(spacing_deg=40.0).rotations()
    assert se3.is_transform(se3.make(rotations, np.zeros((len(rotations), 3)))).all()
    point, ray = np.array([0.1, -0.2, 0.5]), np.array([0.1, -0.05, 1.0])
    seen = se3.transform_points(look_at(rotations, point, ray, 1.7), point[None])[:, 0]
    np.testing.assert_allclose(
        seen, np.tile(1.7 * ray / np.linalg.norm(ray), (len(rotations), 1)), atol=1e-12
    )
    up = rotations[2::5] @ [0.0, 0, 1]  # the middle roll of five
    assert (up[:, 1] < 1e-9).all()


def test_the_best_poses_are_distinct():
    here = se3.make(np.eye(3), [0, 0, 2.0])
    near = se3.exp([0.0, 0.01, 0, 0, 0, 0.01]) @ here
    far = se3.exp([0.0, 0.3, 0, 0, 0, 0]) @ here
    assert best_apart([near, far, here], [0.7, 0.8, 0.9], 3) == [2, 1]
    assert best_apart([near, far, here], [0.7, 0.8, 0.9], 1) == [2]


@pytest.mark.parametrize(("level", "index", "images"), [("free", 4, True), ("free_3", 0, False)])
def test_a_camera_is_found_without_a_start(level, index, images):
    recording = suite.make(level, index, 1)
    assert recording.initial_parent_T_camera is None
    found = solve(recording if images else replace(recording, images=None))
    assert se3.translation_error_m(found.parent_T_camera, recording.truth_parent_T_camera) < 2e-3
    assert se3.rotation_error_rad(found.parent_T_camera, recording.truth_parent_T_camera) < 2e-3
    assert found.diagnostics["search_overlap"] > 0.9


def test_the_suite_keeps_its_conditions():
    recording = suite.make("free", 7, 1)
    distance_m = np.linalg.norm(
        recording.truth_parent_T_camera[:3, 3] - suite.middle(recording.joints_rad[0])
    )
    assert suite.DISTANCE_M[0] <= distance_m <= suite.DISTANCE_M[1]
    assert recording.truth_parent_T_camera[2, 3] > suite.middle(recording.joints_rad[0])[2]
    assert recording.base_T_flange[0, 2, 3] >= suite.LEAST_HEIGHT_M
    again = suite.make("free", 7, 1)
    assert recording.sha256 == again.sha256


def box_recording(folder, azimuth_deg):
    """A box on a box: from the other side it looks the same to the last pixel."""
    for name, size in (("foot", (0.5, 0.3, 0.2)), ("head", (0.15, 0.4, 0.5))):
        trimesh.creation.box(size).export(folder / f"{name}.obj")
    (folder / "box.urdf").write_text(BOX_URDF)
    model = load_robot(folder / "box.urdf")
    K = np.array([[640, 0, 319.5], [0, 640, 239.5], [0, 0, 1]])
    azimuth, height = np.deg2rad(azimuth_deg), np.sin(np.deg2rad(25))
    outward = np.array([np.cos(azimuth) * 0.906, np.sin(azimuth) * 0.906, height])
    forward = -outward / np.linalg.norm(outward)
    right = np.cross(forward, [0, 0, 1]) / np.linalg.norm(np.cross(forward, [0, 0, 1]))
    camera_R_base = np.stack([right, np.cross(forward, right), forward])
    camera_T_base = se3.make(camera_R_base, -camera_R_base @ (2 * outward + [0, 0, 0.3]))
    joints = np.array([[0.35]])
    renderer = Renderer(RenderMesh.of(model), K, 640, 480)
    renderer.draw(camera_T_base @ model.link_poses(joints, frame="base")[0])
    return Recording(
        name="box",
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=("0",),
        robot=RobotDescription(urdf=folder / "box.urdf", base_link="base", flange_link="head"),
        camera=CameraModel(640, 480, K),
        joints_rad=joints,
        masks=(np.where(renderer.face >= 0, 255, 0).astype(np.uint8),),
    )


def test_two_cameras_that_see_the_same_are_refused(tmp_path):
    with pytest.raises(Refusal, match="two cameras explain the masks equally well"):
        solve(box_recording(tmp_path, 35))


def test_masks_of_something_else_are_a_failure():
    recording = suite.make("free", 4, 1)
    ring = np.abs(np.hypot(*np.meshgrid(np.arange(640) - 300, np.arange(480) - 240)) - 180) < 8
    with pytest.raises(SolverFailure, match="no camera on the view sphere"):
        solve(replace(recording, images=None, masks=(np.where(ring, 255, 0).astype(np.uint8),)))


def test_a_moving_camera_is_refused():
    recording = suite.make("free", 4, 1)
    with pytest.raises(Refusal, match="fixed cameras only"):
        solve(replace(recording, mounting=Mounting.EYE_IN_HAND))
