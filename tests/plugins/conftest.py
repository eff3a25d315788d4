"""A small arm by URDF."""

import pytest

_LINK = """<link name="{name}"><visual><origin xyz="0 0 {half}"/><geometry><box size="0.08 0.08 {length}"/></geometry>
<material name="{name}"><color rgba="{colour} 1"/></material></visual></link>"""
_JOINT = """<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>
<origin xyz="0 0 {height}"/><axis xyz="{axis}"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>"""
_LINKS = (("foot", 0.2, "0.1 0.1 0.1"), ("upper", 0.4, "0.8 0.8 0.8"), ("fore", 0.3, "0.2 0.4 0.8"))


@pytest.fixture(scope="session")
def crane(tmp_path_factory):
    """The path of a URDF with two joints and three coloured boxes."""
    links = [_LINK.format(name=n, length=length, half=length / 2, colour=c) for n, length, c in _LINKS]
    joints = [
        _JOINT.format(name="turn", parent="foot", child="upper", height=0.2, axis="0 0 1"),
        _JOINT.format(name="bend", parent="upper", child="fore", height=0.4, axis="0 1 0"),
    ]
    path = tmp_path_factory.mktemp("urdf") / "crane.urdf"
    path.write_text(f'<robot name="crane">{"".join(links + joints)}</robot>')
    return path
