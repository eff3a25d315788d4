"""Links and joints that are no tree: refused with the place and the cure."""

import pytest

from hecbench.errors import InputError
from hecbench.robots.model import load_robot


def link(*names):
    return "".join(f'<link name="{name}"/>' for name in names)


def joint(name, parent, child):
    return f'<joint name="{name}" type="fixed"><parent link="{parent}"/><child link="{child}"/></joint>'


@pytest.mark.parametrize(
    ("inside", "reason"),
    [
        ("", "the robot has no <link>: is it an SRDF, or an xacro .* Give the expanded URDF"),
        (
            '<group name="arm"><chain base_link="a" tip_link="b"/></group>',
            "the robot has no <link>: is it an SRDF",
        ),
        (joint("j", "a", "b"), "there is no 'a'; correct the joint, or add <link name=\"a\"/>"),
        (link("a", "b"), "one root link, this has 2: a, b: join them by a fixed joint"),
        (
            link("a", "b") + joint("j", "a", "b") + joint("k", "b", "a"),
            "form a loop: remove the joint that closes it",
        ),
        (link("a") + joint("j", "a", "a"), "form a loop: remove the joint that closes it"),
        (
            link("w", "a", "b") + joint("j", "a", "b") + joint("k", "b", "a"),
            "joint 'j' hangs on no link of the tree: it is part of a loop; remove the joint",
        ),
    ],
)
def test_what_is_no_tree(tmp_path, inside, reason):
    path = tmp_path / "r.urdf"
    path.write_text(f'<robot name="r">{inside}</robot>')
    with pytest.raises(InputError, match=reason) as refused:
        load_robot(path)
    assert str(refused.value).startswith(str(path))


def test_one_link_is_a_robot_without_joints(tmp_path):
    path = tmp_path / "r.urdf"
    path.write_text(f'<robot name="r">{link("a")}</robot>')
    assert load_robot(path).joint_names == ()


def test_the_world_needs_no_link(tmp_path):
    path = tmp_path / "r.urdf"
    path.write_text(f'<robot name="r">{link("a")}{joint("weld", "world", "a")}</robot>')
    assert load_robot(path).links == ("world", "a")


@pytest.mark.parametrize("version", ["0.0", "1.1", "2.0"])
def test_a_declaration_of_another_version_is_passed_over(tmp_path, version):
    path = tmp_path / "r.urdf"
    path.write_text(f'<?xml version="{version}" ?><robot name="r">{link("a")}</robot>')
    assert load_robot(path).links == ("a",)


@pytest.mark.parametrize(
    "shape", ['<box size="0 0 0"/>', '<sphere radius="0"/>', '<cylinder radius="1" length="0"/>']
)
def test_a_shape_without_a_size_is_left_out_with_a_note(tmp_path, shape):
    path = tmp_path / "r.urdf"
    path.write_text(
        f'<robot name="r"><link name="a"><visual><geometry>{shape}</geometry></visual></link></robot>'
    )
    assert "has no size: left out" in load_robot(path).notes[0]
