"""A URDF read: links, joints and visual shapes; what is wrong is named with its link, attribute and cure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hecbench.errors import InputError
from hecbench.robots import xml
from hecbench.robots.joints import Joint, Motion, ordered, resolved
from hecbench.se3 import Array
from hecbench.system import files

Colour = tuple[float, float, float]

_MOTIONS = {
    "fixed": Motion.FIXED,
    "revolute": Motion.REVOLUTE,
    "continuous": Motion.REVOLUTE,
    "prismatic": Motion.PRISMATIC,
}
_BASES = ("floating", "planar")
_LIMITED = ("revolute", "prismatic")
_FARTHEST_M = 1e4
"""Of a link or shape from what it hangs on."""
_SCALES = (1e-6, 1e6)
"""Least and largest factor of a mesh: from micrometres to what nobody builds."""
_WORLD = "world"
"""The frame that a joint may hang on without a link of that name, as Drake has it."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A mesh file as the URDF names it, and the factors (3,) of its axes."""

    filename: str
    scale: Array


@dataclass(frozen=True)
class Primitive:
    """A box (x, y, z), cylinder (radius, length) or sphere (radius), m."""

    kind: str
    sizes: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Visual:
    """One shape of a link: link_T_shape `origin`, and its URDF colour or texture where it has one."""

    link: str
    origin: Array
    shape: Mesh | Primitive
    colour: Colour | None
    texture: str | None


@dataclass(frozen=True, eq=False)
class Description:
    """A URDF. `joints` are ordered parents first, `links` root first; `notes` are for its user."""

    joints: tuple[Joint, ...]
    links: tuple[str, ...]
    visuals: tuple[Visual, ...]
    notes: tuple[str, ...]


def parse(path: Path) -> Any:
    """The <robot> element of a URDF, without the extensions of other programs.

    Raises:
        InputError: the file is missing, no XML, no URDF, or a xacro.
    """
    root = xml.parse(files.read_bytes(path), f"{path}: not a readable URDF")
    kind = xml.local_name(root)
    if kind != "robot":
        raise InputError(f"{path}: not a readable URDF: it holds <{kind}>, not <robot>; convert it to URDF")
    if any(_is_xacro(element) for element in root.iter()):
        raise InputError(
            f"{path}: it is a xacro, not a URDF: expand the xacro first: run xacro {path.name} > robot.urdf"
        )
    xml.drop_prefixed(root)
    return root


def _is_xacro(element: Any) -> bool:
    if not isinstance(element.tag, str):
        return False
    tag = element.tag.lower()
    if tag.startswith("xacro:") or (tag.startswith("{") and "xacro" in tag.partition("}")[0]):
        return True
    return any("${" in value or "$(" in value for value in element.attrib.values())


def read(path: Path) -> Description:
    """Read a URDF file.

    Raises:
        InputError: it is no URDF, or describes no one tree of links; one line names link or joint and the cure.
    """
    root = parse(path)
    reader = _Reader(path, root)
    links = [reader.name(element, "link") for element in root.findall("link")]
    joints = [reader.joint(element) for element in root.findall("joint")]
    reader.refuse_twice("link", links)
    reader.refuse_twice("joint", [joint.name for joint in joints])
    reader.refuse_twice("the child of two joints: link", [joint.child for joint in joints])
    if _WORLD not in links and any(joint.parent == _WORLD for joint in joints):
        links.insert(0, _WORLD)
    tree, order = ordered(joints, links, path)
    reader.refuse_bases_above_others(tree, order[0])
    visuals = [visual for link in root.findall("link") for visual in reader.visuals(link)]
    return Description(resolved(tree, path, reader.notes), order, tuple(visuals), tuple(reader.notes))


class _Reader:
    """The elements of one URDF as values; collects notes."""

    def __init__(self, path: Path, root: Any) -> None:
        self.path = path
        self.notes: list[str] = []
        self._bases: set[str] = set()
        self._materials: dict[str, Any] = {}
        for material in root.iter("material"):
            described = material.find("color") is not None or material.find("texture") is not None
            if described and material.get("name"):
                self._materials.setdefault(material.get("name"), material)

    def name(self, element: Any, kind: str) -> str:
        if not (name := element.get("name", "").strip()):
            raise InputError(f"{self.path}: a {kind} (line {element.sourceline}) has no name: give it one")
        return str(name)

    def refuse_twice(self, kind: str, names: list[str]) -> None:
        twice = next((name for name, count in Counter(names).items() if count > 1), None)
        if twice is not None:
            raise InputError(f"{self.path}: {kind} '{twice}' is there twice: rename or remove one of them")

    def refuse_bases_above_others(self, joints: tuple[Joint, ...], root: str) -> None:
        """A floating or planar joint stays at its origin, which is right only where it carries the whole robot."""
        fixed = {root}
        for joint in joints:
            if joint.name not in self._bases:
                fixed |= {joint.child} if joint.parent in fixed and joint.motion is Motion.FIXED else set()
            elif joint.parent not in fixed or sum(other.parent == joint.parent for other in joints) > 1:
                raise InputError(
                    f"{self.path}: joint '{joint.name}' is floating or planar within the robot: make the joint fixed"
                )
            else:
                fixed.add(joint.child)
                self.notes.append(
                    f"joint '{joint.name}' is floating or planar: it stays at its origin; choose a base_link below it"
                )

    def numbers(
        self, element: Any, attribute: str, count: int, where: str, default: Array | None = None
    ) -> Array:
        """An attribute's finite numbers (count,)."""
        text = None if element is None else element.get(attribute)
        if text is None and default is not None:
            return default
        try:
            values = np.array([float(word) for word in (text or "").split()])
        except ValueError:
            values = np.zeros(0)
        if len(values) != count or not np.isfinite(values).all():
            expected = "a finite number" if count == 1 else f"{count} finite numbers separated by blanks"
            given = "is absent" if text is None else f'is "{text}"'
            raise InputError(f"{self.path}: {where}: {attribute} {given}: give {expected}")
        return values

    def origin(self, element: Any, where: str) -> Array:
        """The (4, 4) transform of an <origin> below an element, identity when there is none."""
        from hecbench import se3

        origin = element.find("origin")
        xyz = self.numbers(origin, "xyz", 3, f"{where}: origin", np.zeros(3))
        if np.abs(xyz).max() > _FARTHEST_M:
            raise InputError(
                f'{self.path}: {where}: origin: xyz is "{origin.get("xyz")}": give metres, {_FARTHEST_M:g} at most'
            )
        if origin is not None and origin.get("quat_xyzw") is not None:
            quaternion = self.numbers(origin, "quat_xyzw", 4, f"{where}: origin")
            if not np.linalg.norm(quaternion) > 0:
                raise InputError(f"{self.path}: {where}: origin: quat_xyzw turns by nothing: correct it")
            return se3.from_quat_xyzw(quaternion / np.linalg.norm(quaternion), xyz)
        roll, pitch, yaw = self.numbers(origin, "rpy", 3, f"{where}: origin", np.zeros(3))
        turns = (
            se3.so3_exp(angle * axis) for angle, axis in zip((yaw, pitch, roll), np.eye(3)[::-1], strict=True)
        )
        first, second, third = turns
        return np.asarray(se3.make(first @ second @ third, xyz))

    def joint(self, element: Any) -> Joint:
        name = self.name(element, "joint")
        where, kind = f"joint '{name}'", element.get("type", "")
        if kind not in (*_MOTIONS, *_BASES):
            raise InputError(
                f"{self.path}: {where} is of type '{kind}': only {', '.join((*_MOTIONS, *_BASES))} are supported"
            )
        if kind in _BASES:
            self._bases.add(name)
        moves = kind in ("revolute", "continuous", "prismatic")
        axis = self.numbers(element.find("axis"), "xyz", 3, f"{where}: axis", np.array([1.0, 0, 0]))
        if moves and not np.linalg.norm(axis) > 0:
            raise InputError(f"{self.path}: {where} moves along no axis: correct its <axis xyz=...>")
        lower, upper = self._limits(element.find("limit"), where) if kind in _LIMITED else (-np.inf, np.inf)
        mimic = element.find("mimic")
        return Joint(
            name=name,
            motion=_MOTIONS.get(kind, Motion.FIXED),
            parent=self._end(element, "parent", where),
            child=self._end(element, "child", where),
            origin=self.origin(element, where),
            axis=axis / np.linalg.norm(axis) if moves else np.array([1.0, 0, 0]),
            lower=lower,
            upper=upper,
            leader=None if mimic is None or not moves else mimic.get("joint", ""),
            multiplier=float(self.numbers(mimic, "multiplier", 1, f"{where}: mimic", np.ones(1))[0]),
            offset=float(self.numbers(mimic, "offset", 1, f"{where}: mimic", np.zeros(1))[0]),
        )

    def _limits(self, limit: Any, where: str) -> tuple[float, float]:
        """Lower and upper; of one given alone the other is 0, as the URDF's specification says."""
        if limit is None or (limit.get("lower") is None and limit.get("upper") is None):
            return -np.inf, np.inf
        lower, upper = (
            float(self.numbers(limit, side, 1, f"{where}: limit", np.zeros(1))[0])
            for side in ("lower", "upper")
        )
        if lower > upper:
            self.notes.append(
                f"{where}: its limits are reversed ({lower:g}..{upper:g}): swap lower and upper"
            )
        elif lower == upper:
            self.notes.append(f"{where}: the URDF limits it to {lower:g}..{upper:g}: correct its <limit>")
        return lower, upper

    def _end(self, element: Any, side: str, where: str) -> str:
        end = element.find(side)
        if end is None or not end.get("link"):
            raise InputError(f"{self.path}: {where} has no <{side} link=...>: name the link")
        return str(end.get("link"))

    def visuals(self, element: Any) -> Iterator[Visual]:
        """The shapes of a link; one without a shape is left out with a note."""
        link = element.get("name").strip()
        for visual in element.findall("visual"):
            where = f"link '{link}': visual"
            geometry = visual.find("geometry")
            if geometry is None or len(geometry) == 0:
                self.notes.append(
                    f"{where} without a shape: left out; give its <geometry> a mesh, or remove it"
                )
                continue
            if len(geometry) > 1:
                self.notes.append(
                    f"{where} has {len(geometry)} shapes: the first is drawn; give each a <visual> of its own"
                )
            shape = self._shape(geometry[0], where)
            if shape is None:
                self.notes.append(f"{where}: its {geometry[0].tag} has no size: left out")
                continue
            colour, texture = self._material(visual.find("material"), where)
            yield Visual(link, self.origin(visual, where), shape, colour, texture)

    def _shape(self, element: Any, where: str) -> Mesh | Primitive | None:
        """What is drawn; None for a primitive of size 0."""
        kind, where = str(element.tag), f"{where}: {element.tag}"
        if kind == "mesh":
            if not (filename := element.get("filename", "").strip()):
                raise InputError(f"{self.path}: {where} has no filename: name the mesh file")
            scale = self.numbers(element, "scale", 3, where, np.ones(3))
            if not (_SCALES[0] <= np.abs(scale).min() and np.abs(scale).max() <= _SCALES[1]):
                raise InputError(
                    f'{self.path}: {where}: scale is "{element.get("scale")}": no factor may be 0, below'
                    f" {_SCALES[0]:g} or above {_SCALES[1]:g}"
                )
            return Mesh(str(filename), scale)
        if kind == "box":
            sizes = tuple(self.numbers(element, "size", 3, where))
        elif kind == "cylinder":
            sizes = tuple(float(self.numbers(element, side, 1, where)[0]) for side in ("radius", "length"))
        elif kind == "sphere":
            sizes = tuple(self.numbers(element, "radius", 1, where))
        else:
            raise InputError(f"{self.path}: {where} is not supported: use mesh, box, cylinder or sphere")
        if min(sizes) < 0:
            raise InputError(f"{self.path}: {where}: its sizes must be positive")
        return None if min(sizes) == 0 else Primitive(kind, tuple(float(size) for size in sizes))

    def _material(self, material: Any, where: str) -> tuple[Colour | None, str | None]:
        """Colour and texture of a visual; a material may be defined anywhere, the first definition counts."""
        if material is None:
            return None, None
        if material.find("color") is None and material.find("texture") is None:
            name = material.get("name")
            material = self._materials.get(name)
            if material is None:
                self.notes.append(f"{where}: its material '{name}' is defined nowhere: no colour of it")
                return None, None
        texture = material.find("texture")
        named = None if texture is None else texture.get("filename")
        if material.find("color") is None:
            return None, named
        rgba = self.numbers(material.find("color"), "rgba", 4, f"{where}: color")
        if rgba.min() < 0 or rgba.max() > 1:
            self.notes.append(
                f"{where}: its colour goes beyond 0..1: clipped; divide by 255 where it is of 255"
            )
        red, green, blue, _ = np.clip(rgba, 0, 1)
        return (float(red), float(green), float(blue)), named
