"""Robot models: kinematics against two independent libraries, meshes of every format, and clear refusals."""

import logging
import shutil
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from hecbench import se3
from hecbench.errors import InputError
from hecbench.robots.model import load_robot

DENSO = "data/robots/denso_vs060/vs060_description/vs060.urdf"

CUBE_URDF = """<robot name="cube"><link name="world"/><link name="body"><visual>{visual}</visual></link>
<joint name="slide" type="prismatic"><parent link="world"/><child link="body"/><axis xyz="0 0 2"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""


@pytest.fixture(scope="module")
def ur5e():
    return load_robot("ur5e")


@pytest.fixture(scope="module")
def airo_arm():
    """Path of a known arm's URDF by name."""
    root = Path(find_spec("airo_models").origin).parent
    return lambda name: root / "arms" / name / f"{name}.urdf"


@pytest.fixture
def cube(tmp_path):
    def build(visual: str) -> Path:
        path = tmp_path / "cube.urdf"
        path.write_text(CUBE_URDF.format(visual=visual))
        return path

    return build


def random_positions(model, rng, count):
    lower, upper = model.limits().T
    return rng.uniform(np.maximum(lower, -np.pi), np.minimum(upper, np.pi), (count, len(lower)))


@pytest.mark.parametrize("name", ["ur5e", "ur3e", "denso"])
def test_kinematics_agree_with_yourdfpy(name, shared, airo_arm):
    import yourdfpy

    path = shared / DENSO if name == "denso" else airo_arm(name)
    model = load_robot(path, meshes=False)
    logging.getLogger("yourdfpy").setLevel(logging.CRITICAL)
    reference = yourdfpy.URDF.load(str(path), load_meshes=False)
    positions = random_positions(model, np.random.default_rng(0), 5)
    poses = model.link_poses(positions)
    for row, expected in zip(poses, positions, strict=True):
        reference.update_cfg(expected)
        for link, pose in zip(model.links, row, strict=True):
            np.testing.assert_allclose(pose, reference.get_transform(link), atol=1e-6)


def test_kinematics_agree_with_pytorch_kinematics(airo_arm):
    kinematics = pytest.importorskip("pytorch_kinematics")
    torch = pytest.importorskip("torch")
    model = load_robot("ur5e", meshes=False)
    urdf = airo_arm("ur5e").read_text().replace("drake:", "")
    chain = kinematics.build_serial_chain_from_urdf(urdf, "tool0")
    positions = random_positions(model, np.random.default_rng(1), 20)
    expected = chain.to(dtype=torch.float64).forward_kinematics(torch.tensor(positions)).get_matrix().numpy()
    np.testing.assert_allclose(model.forward(positions, tip="tool0"), expected, atol=1e-6)


def test_base_frame_of_the_controller_is_turned_by_pi(ur5e):
    base_T_base_link = ur5e.forward(np.zeros(6), base="base", tip="base_link")
    np.testing.assert_allclose(base_T_base_link, np.diag([-1, -1, 1, 1]), atol=1e-9)


def test_joints_may_be_named_in_any_order(ur5e):
    positions = random_positions(ur5e, np.random.default_rng(2), 3)
    shuffled = ur5e.forward(positions[:, ::-1], ur5e.joint_names[::-1], tip="tool0")
    np.testing.assert_allclose(shuffled, ur5e.forward(positions, tip="tool0"), atol=1e-12)


def test_mimic_joints_follow_their_leader():
    model = load_robot("ur5e+robotiq_2f_85")
    open_, closed = model.link_poses([[0.0], [0.8]], ["gripper/finger_joint"], frame="tool0")
    for side in ("left", "right"):
        pad = model.link_index(f"gripper/{side}_inner_finger_pad")
        assert se3.rotation_error_rad(open_[pad], closed[pad]) < 1e-6  # the pads stay parallel
        assert abs(closed[pad, 0, 3]) < abs(open_[pad, 0, 3]) - 0.03  # and close by 85 mm in all


def test_colours_and_faces_of_the_known_arms(ur5e):
    assert sum(len(part.faces) for part in ur5e.parts) == 121783
    blue = next(part for part in ur5e.parts if part.name.startswith("shoulder_link/URBlue"))
    np.testing.assert_allclose(blue.colour, [0.490196, 0.678431, 0.8], atol=1e-5)
    assert len({part.link for part in ur5e.parts}) == 7


def test_power_cable_is_left_out_and_users_can_leave_out_more(ur5e):
    lowest = min(part.vertices[:, 2].min() for part in ur5e.parts if part.link == "base_link_inertia")
    assert lowest > -0.01
    without_ring = load_robot("ur5e", exclude=["base_link_inertia/Black"])
    assert len(without_ring.parts) == len(ur5e.parts) - 1
    with pytest.raises(InputError, match="no part matches 'knob'"):
        load_robot("ur5e", exclude=["knob"])


def test_collada_robot_with_package_paths(shared):
    model = load_robot(shared / DENSO)
    assert sum(len(part.faces) for part in model.parts) == 7311
    assert {part.colour for part in model.parts} == {(1.0, 1.0, 1.0), (0.4, 0.4, 0.4)}


@pytest.mark.parametrize("suffix", ["stl", "obj", "dae"])
def test_mesh_formats_give_the_same_shape(suffix, cube, tmp_path):
    import trimesh

    trimesh.creation.box((1, 2, 3)).export(tmp_path / f"box.{suffix}")
    model = load_robot(cube(f'<geometry><mesh filename="box.{suffix}" scale="1 1 -1"/></geometry>'))
    (part,) = model.parts
    np.testing.assert_allclose(part.vertices.max(0), [0.5, 1, 1.5])
    corners = part.vertices[part.faces]
    volume = np.linalg.det(corners).sum() / 6
    assert volume == pytest.approx(6.0)  # a mirroring scale keeps the outside outside
    np.testing.assert_allclose(model.forward([0.5], tip="body")[2, 3], 0.5)


def test_primitive_shapes_and_urdf_colours(cube):
    path = cube(
        '<geometry><sphere radius="0.2"/></geometry><material name=""><color rgba="1 0 0.5 1"/></material>'
    )
    (part,) = load_robot(path).parts
    np.testing.assert_allclose(np.linalg.norm(part.vertices, axis=1), 0.2)
    assert part.colour == (1.0, 0.0, 0.5)


def test_cache_survives_damage_and_notices_changes(cube, tmp_path, monkeypatch):
    import trimesh

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    trimesh.creation.box((1, 1, 1)).export(tmp_path / "box.stl")
    path = cube('<geometry><mesh filename="box.stl"/></geometry>')
    first = load_robot(path).parts[0]
    (entry,) = (tmp_path / "cache" / "hecbench").iterdir()
    np.testing.assert_array_equal(load_robot(path).parts[0].vertices, first.vertices)
    entry.write_bytes(entry.read_bytes()[:100])
    np.testing.assert_array_equal(load_robot(path).parts[0].vertices, first.vertices)
    trimesh.creation.box((2, 2, 2)).export(tmp_path / "box.stl")
    assert np.ptp(load_robot(path).parts[0].vertices) == 2
    shutil.rmtree(tmp_path / "cache")
    monkeypatch.setenv("XDG_CACHE_HOME", str(path))  # a file: no folder can be made there
    assert len(load_robot(path).parts) == 1


def test_bad_robots_are_refused_by_name(cube, tmp_path):
    with pytest.raises(InputError, match=r"ur6e: no such URDF file; known robots: ur3e, ur5e"):
        load_robot("ur6e")
    with pytest.raises(InputError, match="known tool"):
        load_robot("ur5e+hand")
    with pytest.raises(InputError, match=r"mesh 'gone\.stl' is not there"):
        load_robot(cube('<geometry><mesh filename="gone.stl"/></geometry>'))
    (tmp_path / "dots.obj").write_text("v 0 0 0\nv 1 0 0\n")
    with pytest.raises(InputError, match=r"dots\.obj"):
        load_robot(cube('<geometry><mesh filename="dots.obj"/></geometry>'))
    (tmp_path / "broken.urdf").write_text("this is no XML")
    with pytest.raises(InputError, match="not a readable URDF"):
        load_robot(tmp_path / "broken.urdf")
    (tmp_path / "two.urdf").write_text('<robot name="r"><link name="a"/><link name="b"/></robot>')
    with pytest.raises(InputError, match="2: a, b"):
        load_robot(tmp_path / "two.urdf")


@pytest.mark.parametrize(
    ("positions", "message"),
    [
        ([0.0] * 5, "5 joint positions given, 6 needed"),
        ([0, 0, np.nan, 0, 0, 0], "finite"),
        ([0, -90, 90, 0, 0, 0], "shoulder_lift_joint at -90 is outside its limits"),
    ],
)
def test_bad_positions_are_refused(ur5e, positions, message):
    with pytest.raises(InputError, match=message):
        ur5e.link_poses(positions)


def test_unknown_names_are_refused(ur5e):
    with pytest.raises(InputError, match="no joint 'j7'"):
        ur5e.link_poses([0.0], ["j7"])
    with pytest.raises(InputError, match="no link 'hand'"):
        ur5e.forward(np.zeros(6), tip="hand")
