"""Robot models from URDF files: batched forward kinematics, joint limits and coloured visual meshes by link.

Forward kinematics follows the URDF convention: every joint places its child by a fixed origin and then turns
about, or slides along, an axis of the joint frame.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from fnmatch import fnmatchcase
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hecbench import se3
from hecbench.errors import InputError
from hecbench.robots.meshes import Part, visual_parts

Array = NDArray[np.float64]

KNOWN_ARMS = ("ur3e", "ur5e")
GRIPPER = "robotiq_2f_85"
_NOT_ON_EVERY_ROBOT = ("base_link_inertia/cable*", "base_link_inertia/M_Text*")
_LIMIT_TOLERANCE = 1e-6


class Motion(StrEnum):
    """What a joint does with its position."""

    FIXED = "fixed"
    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"


_MOTIONS = {
    "fixed": Motion.FIXED,
    "revolute": Motion.REVOLUTE,
    "continuous": Motion.REVOLUTE,
    "prismatic": Motion.PRISMATIC,
}


@dataclass(frozen=True, eq=False)
class Joint:
    """One URDF joint. A mimic joint moves with `leader`: ``position = multiplier * leader + offset``."""

    name: str
    motion: Motion
    parent: str
    child: str
    origin: Array
    """parent_T_joint (4, 4) at position zero."""
    axis: Array
    """Unit axis (3,) in the joint frame."""
    lower: float = -np.inf
    upper: float = np.inf
    leader: str | None = None
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, eq=False)
class RobotModel:
    """A tree of links. `joints` are ordered parents first; `parts` are the visual meshes, one colour each."""

    name: str
    joints: tuple[Joint, ...]
    links: tuple[str, ...]
    parts: tuple[Part, ...] = field(default=(), repr=False)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """The joints that a position can be given for."""
        return tuple(j.name for j in self.joints if j.motion is not Motion.FIXED and j.leader is None)

    def limits(self, joint_names: Sequence[str] | None = None) -> Array:
        """Lower and upper limits (J, 2), rad or m, of the named joints."""
        by_name = {joint.name: joint for joint in self.joints}
        names = self.joint_names if joint_names is None else joint_names
        self._check_names(names)
        return np.array([[by_name[name].lower, by_name[name].upper] for name in names]).reshape(-1, 2)

    def check(self, positions: ArrayLike, joint_names: Sequence[str] | None = None) -> Array:
        """The positions (..., J) as an array; an `InputError` for wrong length, non-finite or off limits."""
        names = self.joint_names if joint_names is None else tuple(joint_names)
        limits = self.limits(names)
        values = np.asarray(positions, float)
        if values.ndim == 0 or values.shape[-1] != len(names):
            given = values.shape[-1] if values.ndim else 0
            raise InputError(
                f"{self.name}: {given} joint positions given, {len(names)} needed: {', '.join(names)}"
            )
        if not np.isfinite(values).all():
            raise InputError(f"{self.name}: joint positions must be finite")
        outside = (values < limits[:, 0] - _LIMIT_TOLERANCE) | (values > limits[:, 1] + _LIMIT_TOLERANCE)
        if outside.any():
            where = tuple(np.argwhere(outside)[0])
            lower, upper = limits[where[-1]]
            raise InputError(
                f"{self.name}: {names[where[-1]]} at {values[where]:.4g} is outside its limits"
                f" {lower:.4g} to {upper:.4g}: degrees instead of radians, or another joint order?"
            )
        return values

    def link_poses(
        self, positions: ArrayLike, joint_names: Sequence[str] | None = None, *, frame: str | None = None
    ) -> Array:
        """frame_T_link (..., L, 4, 4) of every link at positions (..., J) rad or m; frame None: the root.

        Joints without a given position stay at zero, mimic joints follow their leader.
        """
        names = self.joint_names if joint_names is None else tuple(joint_names)
        values = self.check(positions, names)
        given = {name: values[..., column] for column, name in enumerate(names)}
        root_T_link = np.empty((*values.shape[:-1], len(self.links), 4, 4))
        root_T_link[..., 0, :, :] = np.eye(4)
        for joint in self.joints:
            leader = joint.leader or joint.name
            position = given.get(leader, np.zeros(values.shape[:-1])) * joint.multiplier + joint.offset
            parent = self.link_index(joint.parent)
            moved = root_T_link[..., parent, :, :] @ joint.origin @ _displacement(joint, position)
            root_T_link[..., self.link_index(joint.child), :, :] = moved
        if frame is None:
            return root_T_link
        frame_T_root = se3.inverse(root_T_link[..., self.link_index(frame), :, :])
        return np.asarray(frame_T_root[..., None, :, :] @ root_T_link)

    def forward(
        self,
        positions: ArrayLike,
        joint_names: Sequence[str] | None = None,
        *,
        base: str | None = None,
        tip: str,
    ) -> Array:
        """base_T_tip (..., 4, 4) for joint positions (..., J) rad or m."""
        return self.link_poses(positions, joint_names, frame=base)[..., self.link_index(tip), :, :]

    def link_index(self, link: str) -> int:
        """The place of a link in `links`; an `InputError` that names the links when there is none."""
        try:
            return self._link_indices[link]
        except KeyError:
            raise InputError(f"{self.name} has no link '{link}': it has {', '.join(self.links)}") from None

    @cached_property
    def _link_indices(self) -> dict[str, int]:
        return {link: index for index, link in enumerate(self.links)}

    def without(self, patterns: Iterable[str]) -> RobotModel:
        """The model without the parts whose ``link/material`` matches a shell pattern; each must match."""
        patterns = tuple(patterns)
        for pattern in patterns:
            if not any(fnmatchcase(part.name, pattern) for part in self.parts):
                names = ", ".join(part.name for part in self.parts)
                raise InputError(f"{self.name}: no part matches '{pattern}': choose among {names}")
        kept = tuple(p for p in self.parts if not any(fnmatchcase(p.name, pattern) for pattern in patterns))
        return replace(self, parts=kept)

    def with_tool(
        self, tool: RobotModel, flange: str, prefix: str, flange_T_tool: Array | None = None
    ) -> RobotModel:
        """The model with a tool fixed to a link, its root at flange_T_tool (identity if None); names get the prefix.

        The tool may be a second arm: fixed to the root of the first one it stands where its base was measured.
        """
        self.link_index(flange)
        origin = np.eye(4) if flange_T_tool is None else flange_T_tool
        mount = Joint(
            f"{prefix}mount", Motion.FIXED, flange, prefix + tool.links[0], origin, np.array([0, 0, 1.0])
        )
        joints = (
            replace(
                joint,
                name=prefix + joint.name,
                parent=prefix + joint.parent,
                child=prefix + joint.child,
                leader=joint.leader and prefix + joint.leader,
            )
            for joint in tool.joints
        )
        parts = (replace(part, name=prefix + part.name, link=prefix + part.link) for part in tool.parts)
        return RobotModel(
            f"{self.name}+{tool.name}",
            (*self.joints, mount, *joints),
            (*self.links, *(prefix + link for link in tool.links)),
            (*self.parts, *parts),
        )

    def _check_names(self, names: Sequence[str]) -> None:
        unknown = [name for name in names if name not in self.joint_names]
        if unknown:
            raise InputError(f"{self.name} has no joint '{unknown[0]}': it has {', '.join(self.joint_names)}")


def load_robot(name: str | Path, *, exclude: Iterable[str] = (), meshes: bool = True) -> RobotModel:
    """A known robot by name (``ur5e``, ``ur3e``, also ``+robotiq_2f_85``) or any robot by its URDF's path.

    Args:
        name: the name or the path.
        exclude: shell patterns of parts, ``link/material``, that this robot does not have. The power cable
            and the lettering that the known models carry are always left out: they are not on every robot.
        meshes: False loads the kinematics alone.
    """
    arm, _, tool = str(name).partition("+")
    if arm not in KNOWN_ARMS:
        model = _from_urdf(Path(name), Path(name).stem, meshes)
    elif tool not in ("", GRIPPER):
        raise InputError(f"robot '{name}': the known tool is {GRIPPER}")
    else:
        model = _from_urdf(_airo_models() / "arms" / arm / f"{arm}.urdf", arm, meshes)
        model = model.without(_NOT_ON_EVERY_ROBOT) if meshes else model
        if tool:
            urdf = _airo_models() / "grippers" / GRIPPER / "urdf" / f"{GRIPPER}.urdf"
            model = model.with_tool(_from_urdf(urdf, GRIPPER, meshes), "tool0", "gripper/")
    return model.without(exclude) if meshes else model


def _airo_models() -> Path:
    spec = find_spec("airo_models")
    if spec is None or spec.origin is None:
        raise InputError("the robot models are missing: pip install airo-models")
    return Path(spec.origin).parent


def _from_urdf(path: Path, name: str, meshes: bool) -> RobotModel:
    import logging

    import yourdfpy

    logging.getLogger("yourdfpy").setLevel(logging.CRITICAL)  # it reports what it then repairs
    if not path.is_file():
        raise InputError(f"{path}: no such URDF file; known robots: {', '.join(KNOWN_ARMS)}")
    try:
        robot = yourdfpy.URDF.load(str(path), build_scene_graph=False, load_meshes=False).robot
    except Exception as error:  # the parser raises whatever the XML library raises
        raise InputError(f"{path}: not a readable URDF: {str(error).splitlines()[0]}") from error
    joints, links = _ordered(
        [_joint(joint, path) for joint in robot.joints], [link.name for link in robot.links], path
    )
    parts = visual_parts(robot, path) if meshes else ()
    return RobotModel(name, joints, links, parts)


def _joint(joint: Any, path: Path) -> Joint:
    if joint.type not in _MOTIONS:
        raise InputError(
            f"{path}: joint '{joint.name}' is {joint.type}: only {', '.join(_MOTIONS)} are supported"
        )
    unused = joint.axis is None or joint.type == "fixed"
    axis = np.array([1.0, 0, 0]) if unused else np.asarray(joint.axis, float)
    if not np.linalg.norm(axis) > 0:
        raise InputError(f"{path}: joint '{joint.name}' moves along no axis: correct its <axis xyz=...>")
    limited = joint.limit is not None and joint.type in ("revolute", "prismatic")
    return Joint(
        name=joint.name,
        motion=_MOTIONS[joint.type],
        parent=joint.parent,
        child=joint.child,
        origin=np.eye(4) if joint.origin is None else np.asarray(joint.origin, float),
        axis=axis / np.linalg.norm(axis),
        lower=_or(joint.limit.lower, -np.inf) if limited else -np.inf,
        upper=_or(joint.limit.upper, np.inf) if limited else np.inf,
        leader=joint.mimic.joint if joint.mimic else None,
        multiplier=_or(joint.mimic.multiplier, 1.0) if joint.mimic else 1.0,
        offset=_or(joint.mimic.offset, 0.0) if joint.mimic else 0.0,
    )


def _or(value: float | None, default: float) -> float:
    return default if value is None else float(value)


def _ordered(joints: list[Joint], links: list[str], path: Path) -> tuple[tuple[Joint, ...], tuple[str, ...]]:
    """Joints parents first and the links root first; refuses anything that is not one tree."""
    children = {joint.child for joint in joints}
    roots = [link for link in links if link not in children]
    if len(roots) != 1:
        raise InputError(
            f"{path}: a robot has one root link, this has {len(roots)}: {', '.join(roots) or 'a loop'}"
        )
    order, waiting = [roots[0]], list(joints)
    ordered: list[Joint] = []
    while waiting:
        ready = [joint for joint in waiting if joint.parent in order and joint.child not in order]
        if not ready:
            raise InputError(f"{path}: joint '{waiting[0].name}' hangs on no link of the tree")
        ordered.append(ready[0])
        order.append(ready[0].child)
        waiting.remove(ready[0])
    return tuple(ordered), tuple(order)


def _displacement(joint: Joint, position: Array) -> Array:
    """joint_T_child (..., 4, 4) at positions (...)."""
    along = position[..., None] * joint.axis
    if joint.motion is Motion.REVOLUTE:
        return se3.make(se3.so3_exp(along), np.zeros(3))
    if joint.motion is Motion.PRISMATIC:
        return se3.make(np.eye(3), along)
    return np.eye(4)
