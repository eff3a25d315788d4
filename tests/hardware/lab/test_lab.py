"""The lab draws what the camera model says, and its arm keeps the protocol of the real ones."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_hardware import tag_edges, tags
from hecbench_hardware.lab import cells, recordings
from hecbench_hardware.lab.arm import LabRobot
from hecbench_hardware.lab.urdf_arm import UrdfArm
from hecbench_hardware.trials import solids

from hecbench import se3
from hecbench.errors import HecbenchError, InputError
from hecbench.recording import CameraModel
from hecbench.rendering.mesh import RenderMesh
from hecbench.rendering.renderer import Renderer

ODD = CameraModel(400, 300, np.array([[520.0, 0, 170], [0, 560, 165], [0, 0, 1]]))
DISTORTED = replace(ODD, distortion=np.array([-0.25, 0.08, 0.002, -0.003, 0.01]))


@pytest.mark.parametrize("camera", [ODD, DISTORTED], ids=["pinhole", "distorted"])
@pytest.mark.parametrize("whole", [True, False])
def test_tag_is_where_the_camera_model_projects_it(eye_of, lab_scene, station, near_view, camera, whole):
    base_T_workpiece, base_T_camera = near_view
    truth = se3.inverse(base_T_camera) @ base_T_workpiece @ solids.workpiece_T_tag()
    lab_scene.place(station.home_rad, base_T_workpiece)
    eye = eye_of(camera, whole=whole)
    points = se3.transform_points(base_T_workpiece @ solids.workpiece_T_tag(), solids.TAG.points_m)
    found = tags.locate(eye.image(base_T_camera, fine_m=points), camera, solids.TAG)
    expected = tag_edges.project(camera, truth, solids.TAG.points_m)
    assert np.abs(tag_edges.project(camera, found.camera_T_tag, solids.TAG.points_m) - expected).max() < 0.1
    assert np.abs(found.corners_px - expected).max() < 0.6
    assert se3.translation_error_m(found.camera_T_tag, truth) < 2e-3


def test_mask_is_what_the_rasteriser_of_the_framework_draws(eye_of, lab_scene, station):
    camera = cells.camera_model(480, 400)
    base_T_camera = station.camera_pose(4)
    lab_scene.place(station.home_rad, station.workpiece_pose(0))
    mask = eye_of(camera).mask(base_T_camera)
    renderer = Renderer(RenderMesh.of(station.robot), camera.K, camera.width, camera.height)
    base_T_link = station.robot.link_poses(station.home_rad, station.joint_names, frame=station.base_link)
    renderer.draw(se3.inverse(base_T_camera) @ base_T_link)
    drawn = renderer.part >= 0
    hidden_by_the_tag = drawn & ~mask
    assert (mask & ~drawn).sum() < 0.02 * mask.sum()
    assert 0.01 < mask.mean() < 0.15
    assert hidden_by_the_tag.sum() < 0.35 * drawn.sum()


def test_noise_is_as_strong_as_asked_and_drawn_from_the_generator(eye_of, lab_scene, station, near_view):
    lab_scene.place(station.home_rad, near_view[0])
    camera = cells.camera_model(160, 120)
    eye = eye_of(camera, noise=4.0)
    clean = eye.image(near_view[1]).astype(float)
    noisy = [eye.image(near_view[1], np.random.default_rng(5)).astype(float) for _ in range(2)]
    assert (noisy[0] == noisy[1]).all()
    middle = (clean > 30) & (clean < 225)
    assert (noisy[0] - clean)[middle].std() == pytest.approx(4.0, rel=0.1)


def test_missing_graphics_are_one_line_with_the_packages(monkeypatch):
    from hecbench_hardware.lab import gl

    pytest.importorskip("mujoco", reason="the lab needs mujoco: pip install 'hecbench[lab]'")

    def absent(width, height):
        raise AttributeError("'NoneType' object has no attribute 'eglQueryString'")

    monkeypatch.setattr(gl, "_egl", absent)
    monkeypatch.setattr(gl, "_osmesa", absent)
    with pytest.raises(HecbenchError, match=r"EGL: .*apt install libegl1"):
        gl.open_context(16, 16)


def test_arm_goes_where_it_is_told_within_its_limits(station):
    robot = LabRobot(station)
    with pytest.raises(InputError, match="read-only"):
        robot.move_joints(station.home_rad)
    robot.enable()
    goal = station.configuration_rad(0)
    robot.move_joints(goal)
    pose = robot.state().base_T_flange
    assert np.allclose(pose, station.arm.forward(goal))
    lower = se3.make(np.eye(3), [0, 0, -0.05]) @ pose
    robot.move_linear(lower)
    assert np.allclose(robot.settle().base_T_flange, lower, atol=1e-9)
    with pytest.raises(InputError, match="leaves the workspace"):
        robot.move_linear(se3.make(np.eye(3), [0, 0, -0.7]) @ pose)
    assert np.allclose(robot.state().base_T_flange, lower, atol=1e-9)


def test_every_calibration_shows_tag_and_workpiece_in_front(station):
    camera = cells.camera_model()
    size = np.array([camera.width, camera.height])
    for number in range(station.calibrations):
        camera_T_base = se3.inverse(station.camera_pose(number))
        flange_tag = station.flange_tag(number)
        on_flange = station.arm.forward(station.configuration_rad(number)) @ flange_tag.flange_T_tag
        tags_seen = [on_flange] + [station.workpiece_pose(p) @ solids.workpiece_T_tag() for p in range(3)]
        for base_T_tag in tags_seen:
            camera_T_tag = camera_T_base @ base_T_tag
            assert camera_T_tag[2, 2] > 0.4
            pixels = tag_edges.project(camera, camera_T_tag, solids.TAG.points_m)
            assert ((pixels > 50) & (pixels < size - 50)).all()
    with pytest.raises(InputError, match="0 to 17"):
        station.camera_pose(18)


def test_numerical_kinematics_agree_with_the_closed_form(station, rng):
    from hecbench.robots.model import load_robot

    arm = UrdfArm("ur5e", load_robot("ur5e", meshes=False), "base", "tool0")
    near = station.configuration_rad(0)
    for _ in range(5):
        joints = near + rng.uniform(-0.3, 0.3, 6)
        assert np.allclose(
            arm.chain.forward(joints, base="base", tip="tool0"), station.arm.forward(joints), atol=1e-6
        )


def test_vs060_reaches_every_place(shared):
    station = cells.station("vs060", str(shared / "data/robots/denso_vs060/vs060_description/vs060.urdf"))
    from hecbench_hardware.trials import tasks

    assert station.calibrations == 6
    for place in range(3):
        for task in tasks.Task:
            end = station.workpiece_pose(place) @ tasks.workpiece_T_tool(task)
            flange = tasks.above(end, tasks.stroke_m(task)) @ se3.inverse(station.gripper.flange_T_tool)
            found = station.arm.inverse(flange, station.home_rad)
            assert len(found) == 1
            assert np.allclose(station.arm.forward(found[0]), flange, atol=1e-6)


def test_photographs_have_no_masks_and_rooms_of_their_own(drawable):
    first, second = (recordings.photograph_recording(calibration, samples=1) for calibration in (0, 1))
    assert first.masks is None
    assert first.initial_parent_T_camera is not None
    np.testing.assert_array_equal(first.image(0), recordings.photograph_recording(0, samples=1).image(0))
    view = recordings.view_recording(0, samples=1)
    np.testing.assert_array_equal(first.truth_parent_T_camera, view.truth_parent_T_camera)
    away = ~view.mask(0)
    assert (
        np.abs(first.image(0)[away].astype(int) - view.image(0)[away]).mean() > 3
    )  # other clutter, more noise
    assert not np.array_equal(first.image(0), second.image(0))


def test_view_recording_has_pictures_masks_and_truth(drawable, station):
    recording = recordings.view_recording(0, samples=2)
    assert recording.image(0).shape == (480, 640, 3)
    assert 0.01 < recording.mask(1).mean() < 0.3
    assert recording.truth_parent_T_camera is not None
    assert np.allclose(recording.base_T_flange, station.arm.forward(recording.joints_rad))


def test_unknown_station_is_refused():
    with pytest.raises(InputError, match="choose ur5e or vs060"):
        cells.station("panda")
    with pytest.raises(InputError, match="needs its URDF"):
        cells.station("vs060")
