"""A written model reads back as it was: kinematics, limits, mimic joints, colours, shapes; also two arms in one."""

import numpy as np

from hecbench import se3
from hecbench.robots.model import load_robot
from hecbench.robots.writer import write_urdf


def test_reads_back_as_it_was(tmp_path, rng):
    model = load_robot("ur3e+robotiq_2f_85")
    write_urdf(model, tmp_path / "copy.urdf")
    copy = load_robot(tmp_path / "copy.urdf")
    assert set(copy.links) == set(model.links)
    np.testing.assert_allclose(copy.limits(model.joint_names), model.limits(), rtol=1e-12)
    positions = rng.uniform(*np.clip(model.limits().T, -3, 3), (5, len(model.joint_names)))
    order = [copy.link_index(link) for link in model.links]
    poses = copy.link_poses(positions, model.joint_names)
    np.testing.assert_allclose(poses[:, order], model.link_poses(positions), atol=1e-9)
    assert len(copy.parts) == len(model.parts)
    for part in model.parts:
        same = [p for p in copy.parts if p.link == part.link and len(p.faces) == len(part.faces)]
        assert any(
            np.allclose(p.colour, part.colour)
            and np.allclose(p.vertices[p.faces], part.vertices[part.faces], atol=1e-6)
            for p in same
        ), part.name


def test_a_second_arm_stands_where_it_was_put(tmp_path):
    arm, base_T_right = load_robot("ur3e"), se3.exp([0, 0, 2.5, 0.8, 0.3, 0.1])
    pair = arm.with_tool(arm, "base_link", "right/", base_T_right)
    write_urdf(pair, tmp_path / "pair.urdf")
    read = load_robot(tmp_path / "pair.urdf")
    joints = np.array([0.1, -1.2, 1.3, -0.4, -1.1, 0.7])
    positions = np.r_[np.zeros(6), joints]
    tip = read.forward(positions, pair.joint_names, base="base_link", tip="right/tool0")
    np.testing.assert_allclose(tip, base_T_right @ arm.forward(joints, tip="tool0"), atol=1e-9)
    assert len(read.parts) == 2 * len(arm.parts)
