"""Starts in millimetres, OpenGL axes or the other direction are named as that, never a LinAlgError."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hecbench_plugins.solvers.render_gn import render_gn

from hecbench import diagnose, se3
from hecbench.diagnose import Severity
from hecbench.errors import Refusal
from hecbench.recording import CameraModel, Mounting, Recording, RobotDescription
from hecbench.storage import recording_io

URDF = """<robot name="r"><link name="base"><visual><geometry>{shape}</geometry></visual></link><link name="tip"/>
<joint name="a" type="prismatic"><parent link="base"/><child link="tip"/><origin xyz="0 0 0.5"/><axis xyz="0 0 1"/>
<limit lower="0" upper="0.04" effort="1" velocity="1"/></joint></robot>"""
LOOKS_DOWN = se3.make(np.diag([1.0, -1.0, -1.0]), np.array([0, 0, 2.0]))


@pytest.fixture
def cell(tmp_path):
    def cell(shape='<box size="0.1 0.1 0.1"/>', position=0.01, start=LOOKS_DOWN):
        (tmp_path / "r.urdf").write_text(URDF.format(shape=shape))
        return Recording(
            name="c",
            mounting=Mounting.EYE_TO_HAND,
            sample_ids=("0",),
            robot=RobotDescription(
                urdf=tmp_path / "r.urdf", base_link="base", flange_link="tip", joint_names=("a",)
            ),
            camera=CameraModel(64, 48, np.array([[60.0, 0, 32], [0, 60, 24], [0, 0, 1]])),
            joints_rad=np.array([[position]]),
            initial_parent_T_camera=start,
            masks=(np.pad(np.full((8, 8), 255, np.uint8), ((20, 20), (28, 28))),),
        )

    return cell


IN_MILLIMETRES = LOOKS_DOWN.copy()
IN_MILLIMETRES[:3, 3] *= 1000


@pytest.mark.parametrize(
    ("start", "reason"),
    [
        (IN_MILLIMETRES, r"the robot is 2,000 m from the camera: initial_parent_T_camera in millimetres\?"),
        (
            LOOKS_DOWN @ np.diag([1.0, -1, -1, 1]),
            r"z must look forward \(OpenCV\); this start fits OpenGL axes",
        ),
        (se3.make(np.eye(3), np.array([9.0, 9, 2])), r"z must look forward \(OpenCV\)$"),
    ],
)
def test_odd_starts_are_named(cell, start, reason):
    recording = cell(start=start)
    with pytest.raises(Refusal, match=reason):
        render_gn()(recording, rng=np.random.default_rng(0))
    (finding,) = (f for f in diagnose.check(recording) if f.id == "robot_model")
    assert finding.severity is Severity.WARNING


@pytest.mark.parametrize(
    ("case", "reason"),
    [
        ("start_in_millimetres", "m from the camera: initial_parent_T_camera in millimetres"),
        ("start_in_opengl_axes", "behind the camera.*this start fits OpenGL axes"),
    ],
)
def test_shared_starts(shared, case, reason):
    recording = recording_io.load(shared / "cases" / "robot" / case)
    with pytest.raises(Refusal, match=reason):
        render_gn()(recording.without_truth(), rng=np.random.default_rng(0))


def test_a_mesh_in_millimetres_is_a_critical_finding(cell, tmp_path):
    trimesh.creation.box((100, 100, 100)).export(tmp_path / "c.stl")
    (finding,) = (f for f in diagnose.check(cell('<mesh filename="c.stl"/>')) if f.id == "robot_model")
    assert finding.severity is Severity.CRITICAL
    assert (
        'mesh c.stl is 100 m wide, the robot reaches 0.5 m: in millimetres? add scale="0.001'
        in finding.summary
    )


def test_a_finger_a_hair_beyond_its_limit_is_noted(cell):
    (finding,) = (f for f in diagnose.check(cell(position=0.04003)) if f.id == "robot_model")
    assert finding.severity is Severity.INFO
    assert "a at 0.04003 is a hair beyond its limits 0 to 0.04" in finding.summary


def test_a_sound_robot_is_ok(cell):
    (finding,) = (f for f in diagnose.check(cell()) if f.id == "robot_model")
    assert finding.severity is Severity.OK
    named = replace(cell(), robot=RobotDescription(model="ur5e"), joints_rad=np.zeros((1, 6)))
    assert not [f for f in diagnose.check(named) if f.id == "robot_model"]
