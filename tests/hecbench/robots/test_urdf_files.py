"""A URDF is copied with all it needs, and draws the same afterwards."""

from dataclasses import replace

import numpy as np
import pytest

from hecbench.errors import InputError
from hecbench.recording import CameraModel, Mounting, Recording, RobotDescription
from hecbench.robots import urdf_files
from hecbench.robots.model import load_robot
from hecbench.running import planning
from hecbench.storage import recording_io

OBJ = """mtllib {mtl}
usemtl paint
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
"""
MTL = "newmtl paint\nKd {} 0.2 0.1\n"
URDF = """<robot name="two">
<link name="a"><visual><geometry><mesh filename="package://two/a/shape.obj"/></geometry></visual>
<collision><geometry><mesh filename="package://two/lost.stl"/></geometry></collision></link>
<link name="b"><visual><geometry><mesh filename="package://two/b/shape.obj"/></geometry></visual></link>
<joint name="turn" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""


@pytest.fixture
def urdf(tmp_path):
    """Two links whose meshes and material files share their names."""
    for link, red in (("a", 0.9), ("b", 0.3)):
        folder = tmp_path / "two" / link
        folder.mkdir(parents=True)
        (folder / "shape.obj").write_text(OBJ.format(mtl="material.lib"))
        (folder / "material.lib").write_text(MTL.format(red))
    (tmp_path / "two" / "two.urdf").write_text(URDF)
    return tmp_path / "two" / "two.urdf"


def parts(path):
    return [(p.link, p.colour, p.vertices.tolist(), p.faces.tolist()) for p in load_robot(path).parts]


def test_the_copy_stands_alone_and_is_the_same(urdf, tmp_path):
    before = parts(urdf)
    copied = urdf_files.copy(urdf, tmp_path / "elsewhere" / "robot")
    urdf.parent.rename(tmp_path / "gone")
    assert parts(copied) == before
    assert [part[1][0] for part in before] == pytest.approx([0.9, 0.3], abs=0.01)
    assert "collision" not in copied.read_text()


def test_a_real_robot(shared, tmp_path):
    urdf = shared / "data" / "robots" / "denso_vs060" / "vs060_description" / "vs060.urdf"
    assert parts(urdf_files.copy(urdf, tmp_path)) == parts(urdf)


def test_faults_are_named(urdf, tmp_path):
    (urdf.parent / "b" / "shape.obj").unlink()
    with pytest.raises(InputError, match=r"two\.urdf: mesh 'package://two/b/shape\.obj' is not there"):
        urdf_files.copy(urdf, tmp_path / "x")
    urdf.write_text("<robot")
    with pytest.raises(InputError, match=r"two\.urdf: not a readable URDF"):
        urdf_files.copy(urdf, tmp_path / "x")


def recording(**robot):
    return Recording(
        name="r",
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=("0",),
        robot=RobotDescription(**robot),
        camera=CameraModel(4, 4, np.array([[9.0, 0, 2], [0, 9, 2], [0, 0, 1]])),
        joints_rad=np.array([[0.5]]),
    )


def test_a_recording_gets_a_robot_and_keeps_it(urdf, tmp_path):
    bare = replace(recording(base_link="a", flange_link="b"), notes=("give --urdf FILE", "holds no start"))
    with_robot = planning.with_robot(bare, urdf)
    assert with_robot.notes == ("holds no start",)
    recording_io.save(with_robot, tmp_path / "cell")
    urdf.parent.rename(tmp_path / "gone")
    loaded = recording_io.load(tmp_path / "cell")
    assert loaded.robot.urdf == tmp_path / "cell" / "robot" / "two.urdf"
    assert loaded.robot.joint_names == ("turn",)
    assert len(load_robot(loaded.robot.urdf).parts) == 2
    recording_io.save(loaded, tmp_path / "cell")
    assert recording_io.load(tmp_path / "cell").robot.urdf == loaded.robot.urdf


@pytest.mark.parametrize(
    ("robot", "message"),
    [
        ({"base_link": "panda_link0", "flange_link": "b"}, "has no link 'panda_link0'"),
        ({"base_link": "a", "flange_link": "b", "joint_names": ("elbow",)}, "has no joint 'elbow'"),
    ],
)
def test_another_robots_urdf_is_refused(urdf, robot, message):
    with pytest.raises(InputError, match=message):
        planning.with_robot(recording(**robot), urdf)


def test_a_fixed_joint_needs_no_axis_and_a_moving_one_does(tmp_path):
    text = (
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="{}"><parent link="a"/>'
        '<child link="b"/><axis xyz="0 0 0"/></joint></robot>'
    )
    (tmp_path / "fixed.urdf").write_text(text.format("fixed"))
    (tmp_path / "moving.urdf").write_text(text.format("continuous"))
    assert np.isfinite(load_robot(tmp_path / "fixed.urdf").joints[0].axis).all()
    with pytest.raises(InputError, match=r"moving\.urdf: joint 'j' moves along no axis"):
        load_robot(tmp_path / "moving.urdf")
