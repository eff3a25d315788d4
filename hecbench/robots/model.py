"""Robot models from URDF files: batched forward kinematics, joint limits and coloured visual meshes by link.

Forward kinematics follows the URDF convention: every joint places its child by a fixed origin and then turns
about, or slides along, an axis of the joint frame.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from hecbench import se3
from hecbench.errors import InputError
from hecbench.robots import packages, urdf
from hecbench.robots.joints import Joint, Motion
from hecbench.robots.meshes import Part, visual_parts
from hecbench.se3 import Array

KNOWN_ARMS = ("ur3e", "ur5e")
GRIPPER = "robotiq_2f_85"
_NOT_ON_EVERY_ROBOT = ("base_link_inertia/cable*", "base_link_inertia/M_Text*")


@dataclass(frozen=True, eq=False)
class RobotModel:
    """A tree of links. `joints` are ordered parents first; `parts` are the visual meshes, one colour each.

    `notes` say what its user should know: what was left out, and what looks like a fault of the URDF.
    """

    name: str
    joints: tuple[Joint, ...]
    links: tuple[str, ...]
    parts: tuple[Part, ...] = field(default=(), repr=False)
    notes: tuple[str, ...] = ()

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """The joints that move on their own. Positions may be given for mimic joints as well."""
        return tuple(j.name for j in self.joints if j.motion is not Motion.FIXED and j.leader is None)

    def limits(self, joint_names: Sequence[str] | None = None) -> Array:
        """Lower and upper limits (J, 2), rad or m, of the named joints."""
        joints = self._named(self.joint_names if joint_names is None else joint_names)
        return np.array([[joint.lower, joint.upper] for joint in joints]).reshape(-1, 2)

    def check(self, positions: ArrayLike, joint_names: Sequence[str] | None = None) -> Array:
        """The positions (..., J) as an array; an `InputError` for wrong length, non-finite or off limits.

        A position that is a hair beyond its limit (`Joint.hair`) is taken as it is.
        """
        joints = self._named(self.joint_names if joint_names is None else joint_names)
        values = np.asarray(positions, float)
        if values.ndim == 0 or values.shape[-1] != len(joints):
            given = values.shape[-1] if values.ndim else 0
            needed = ", ".join(joint.name for joint in joints)
            raise InputError(f"{self.name}: {given} joint positions given, {len(joints)} needed: {needed}")
        if not np.isfinite(values).all():
            raise InputError(f"{self.name}: joint positions must be finite")
        for column, joint in enumerate(joints):
            if (refused := joint.refuses(values[..., column])).any():
                raise InputError(f"{self.name}: {joint.reason(float(values[..., column][refused].flat[0]))}")
        return values

    def beyond(self, positions: ArrayLike, joint_names: Sequence[str] | None = None) -> tuple[str, ...]:
        """One sentence for each joint that positions (..., J) take a hair beyond its limits."""
        joints = self._named(self.joint_names if joint_names is None else joint_names)
        values = self.check(positions, joint_names)
        return tuple(
            f"{joint.name} at {float(values[..., column][beyond].flat[0]):.6g} is a hair beyond its limits "
            f"{joint.lower:.6g} to {joint.upper:.6g}: taken as it is"
            for column, joint in enumerate(joints)
            if (beyond := joint.is_beyond(values[..., column])).any()
        )

    def link_poses(
        self, positions: ArrayLike, joint_names: Sequence[str] | None = None, *, frame: str | None = None
    ) -> Array:
        """frame_T_link (..., L, 4, 4) of every link at positions (..., J) rad or m; frame None: the root.

        Joints without a given position stay at zero, mimic joints without one follow their leader; a leader
        without one is where its first given follower has it.
        """
        names = self.joint_names if joint_names is None else tuple(joint_names)
        values = self.check(positions, names)
        given = {name: values[..., column] for column, name in enumerate(names)}
        for joint in self._named(names):
            if joint.leader is not None and joint.multiplier:
                given.setdefault(joint.leader, (given[joint.name] - joint.offset) / joint.multiplier)
        root_T_link = np.empty((*values.shape[:-1], len(self.links), 4, 4))
        root_T_link[..., 0, :, :] = np.eye(4)
        for joint in self.joints:
            position = given.get(joint.name)
            if position is None:
                led = given.get(joint.leader or joint.name, np.zeros(values.shape[:-1]))
                position = led * joint.multiplier + joint.offset
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
            (*self.notes, *tool.notes),
        )

    def _named(self, names: Sequence[str]) -> list[Joint]:
        """The joints of these names; an `InputError` for one that is not there, fixed, or named twice."""
        by_name = {joint.name: joint for joint in self.joints if joint.motion is not Motion.FIXED}
        for name in names:
            if name not in by_name:
                raise InputError(f"{self.name} has no joint '{name}': it has {', '.join(self.joint_names)}")
        if len(set(names)) < len(names):
            raise InputError(f"{self.name}: a joint is named twice: {', '.join(names)}")
        return [by_name[name] for name in names]


def load_robot(name: str | Path, *, exclude: Iterable[str] = (), meshes: bool = True) -> RobotModel:
    """A known robot by name (``ur5e``, ``ur3e``, also ``+robotiq_2f_85``) or any robot by its URDF.

    Args:
        name: the name, the path of a URDF, ``PACKAGE:PATH``, or a name that an installed package gives
            (see `hecbench.robots.packages`).
        exclude: shell patterns of parts, ``link/material``, that this robot does not have. The power cable
            and the lettering that the known models carry are always left out: they are not on every robot.
        meshes: False loads the kinematics alone.
    """
    arm, _, tool = str(name).partition("+")
    if arm not in KNOWN_ARMS:
        path = Path(name) if os.path.isfile(name) else packages.find(str(name)) or Path(name)
        model = _from_urdf(path, path.stem, meshes)
    elif tool not in ("", GRIPPER):
        raise InputError(f"robot '{name}': the known tool is {GRIPPER}")
    else:
        model = _from_urdf(_airo_models() / "arms" / arm / f"{arm}.urdf", arm, meshes)
        model = model.without(_NOT_ON_EVERY_ROBOT) if meshes else model
        if tool:
            file = _airo_models() / "grippers" / GRIPPER / "urdf" / f"{GRIPPER}.urdf"
            model = model.with_tool(_from_urdf(file, GRIPPER, meshes), "tool0", "gripper/")
    return model.without(exclude) if meshes else model


def _airo_models() -> Path:
    spec = find_spec("airo_models")
    if spec is None or spec.origin is None:
        raise InputError("the robot models are missing: pip install airo-models")
    return Path(spec.origin).parent


def _from_urdf(path: Path, name: str, meshes: bool) -> RobotModel:
    if not os.path.isfile(path):
        raise InputError(
            f"{path}: no such URDF file; known robots: {', '.join(KNOWN_ARMS)}, and those that"
            " hecbench plugins --kind robot lists"
        )
    description = urdf.read(path)
    parts, notes = visual_parts(description.visuals, path) if meshes else ((), ())
    return RobotModel(name, description.joints, description.links, parts, (*description.notes, *notes))


def _displacement(joint: Joint, position: Array) -> Array:
    """joint_T_child (..., 4, 4) at positions (...)."""
    along = position[..., None] * joint.axis
    if joint.motion is Motion.REVOLUTE:
        return se3.make(se3.so3_exp(along), np.zeros(3))
    if joint.motion is Motion.PRISMATIC:
        return se3.make(np.eye(3), along)
    return np.eye(4)
