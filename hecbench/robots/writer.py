"""A robot model as a URDF file with its meshes beside it, so that a recording can name it."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from hecbench.robots.joints import Joint
from hecbench.robots.meshes import Part
from hecbench.robots.model import RobotModel

_PARALLEL = 1e-9


def write_urdf(model: RobotModel, path: Path) -> None:
    """Write `path` and, in the folder of its stem, one STL file per visual part; reads back as the same model."""
    import trimesh

    meshes = path.parent / path.stem
    meshes.mkdir(parents=True, exist_ok=True)
    robot = ElementTree.Element("robot", name=path.stem)
    links = {name: ElementTree.SubElement(robot, "link", name=name) for name in model.links}
    for number, part in enumerate(model.parts):
        file = meshes / f"{number:03d}.stl"
        trimesh.Trimesh(part.vertices, part.faces, process=False).export(file)
        _add_visual(links[part.link], part, f"{path.stem}/{file.name}")
    for joint in model.joints:
        _add_joint(robot, joint)
    ElementTree.indent(robot)
    ElementTree.ElementTree(robot).write(path, encoding="utf-8", xml_declaration=True)


def _add_visual(link: ElementTree.Element, part: Part, file: str) -> None:
    visual = ElementTree.SubElement(link, "visual")
    ElementTree.SubElement(ElementTree.SubElement(visual, "geometry"), "mesh", filename=file)
    material = ElementTree.SubElement(visual, "material", name=part.name)
    ElementTree.SubElement(material, "color", rgba=_text([*part.colour, 1]))


def _add_joint(robot: ElementTree.Element, joint: Joint) -> None:
    limited = np.isfinite([joint.lower, joint.upper]).all()
    element = ElementTree.SubElement(robot, "joint", name=joint.name, type=joint.kind)
    ElementTree.SubElement(element, "parent", link=joint.parent)
    ElementTree.SubElement(element, "child", link=joint.child)
    ElementTree.SubElement(
        element, "origin", xyz=_text(joint.origin[:3, 3]), rpy=_text(_roll_pitch_yaw(joint.origin[:3, :3]))
    )
    ElementTree.SubElement(element, "axis", xyz=_text(joint.axis))
    if limited:
        bounds = {"lower": repr(float(joint.lower)), "upper": repr(float(joint.upper))}
        ElementTree.SubElement(element, "limit", bounds, effort="0", velocity="0")
    if joint.leader:
        follow = {"multiplier": repr(float(joint.multiplier)), "offset": repr(float(joint.offset))}
        ElementTree.SubElement(element, "mimic", follow, joint=joint.leader)


def _roll_pitch_yaw(R: NDArray[np.float64]) -> NDArray[np.float64]:
    """URDF's angles: R = Rz(yaw) Ry(pitch) Rx(roll). Yaw is 0 where the axes of roll and yaw coincide."""
    across = np.hypot(R[0, 0], R[1, 0])
    pitch = np.arctan2(-R[2, 0], across)
    if across < _PARALLEL:
        return np.array([np.arctan2(-R[1, 2], R[1, 1]), pitch, 0.0])
    return np.array([np.arctan2(R[2, 1], R[2, 2]), pitch, np.arctan2(R[1, 0], R[0, 0])])


def _text(numbers: NDArray[np.float64] | list[float]) -> str:
    return " ".join(repr(float(number)) for number in numbers)
