"""What one network is taught about some robots: classes of colour, and points where axes and links meet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hecbench.errors import InputError
from hecbench.rendering import RenderMesh
from hecbench.rendering.smooth import Normals, normals
from hecbench.robots.model import RobotModel, load_robot
from hecbench.se3 import Array
from hecbench_plugins.perception.skeleton import Keypoint, keypoint_positions, keypoints_of

MOST_COLOURS = 4
_SAME_COLOUR = 0.05
"""Colours nearer than this (RGB in [0, 1]) are one."""


@dataclass(frozen=True, eq=False)
class Arm:
    """One robot of a family: its mesh, the colour class of every part, and its keypoints."""

    model: RobotModel
    mesh: RenderMesh
    part_class: NDArray[np.uint8]
    """(P,) rows of the family's palette."""
    keypoints: tuple[Keypoint, ...]

    @cached_property
    def normals(self) -> Normals:
        """Of the mesh's surface."""
        return normals(self.mesh)

    def classes(self, face: NDArray[np.int32]) -> NDArray[np.uint8]:
        """The colour class (H, W) of the face that each pixel sees, 0 where it sees none."""
        seen, found = face >= 0, np.zeros(face.shape, np.uint8)
        found[seen] = self.part_class[self.mesh.face_part[face[seen]]]
        return found

    def keypoint_positions(self, frame_T_link: ArrayLike) -> Array:
        """(..., K, 3) m in the frame of frame_T_link (..., L, 4, 4)."""
        return keypoint_positions(self.model.links, self.keypoints, frame_T_link)


@dataclass(frozen=True, eq=False)
class Family:
    """Robots that share a network. The first row of `palette` (1 + C, 3) is the black background."""

    arms: tuple[Arm, ...]
    palette: Array

    @property
    def names(self) -> tuple[str, ...]:
        """Of the robots."""
        return tuple(arm.model.name for arm in self.arms)

    @property
    def keypoint_count(self) -> int:
        """Keypoints of each robot, the same for all."""
        return len(self.arms[0].keypoints)

    @staticmethod
    def of(robots: Sequence[str]) -> Family:
        """The family of known names or paths of URDF files.

        Raises:
            InputError: no robot is given, one has no meshes, or they differ in their keypoints.
        """
        if not robots:
            raise InputError("a family takes one robot or more: --robot ur5e")
        models = [load_robot(name) for name in robots]
        for model in models:
            if not model.parts:
                raise InputError(
                    f"{model.name}: the model has no visual meshes, so that nothing can be drawn"
                )
        palette = palette_of(models[0])
        arms = tuple(_arm(model, palette) for model in models)
        for arm in arms[1:]:
            if len(arm.keypoints) != len(arms[0].keypoints):
                raise InputError(
                    f"{arm.model.name} has {len(arm.keypoints)} keypoints, {arms[0].model.name}"
                    f" {len(arms[0].keypoints)}: train one network for each"
                )
        return Family(arms, palette)


def _arm(model: RobotModel, palette: Array) -> Arm:
    mesh = RenderMesh.of(model)
    apart = np.linalg.norm(mesh.colours[:, None] - palette[None, 1:], axis=2)
    return Arm(model, mesh, (1 + apart.argmin(1)).astype(np.uint8), keypoints_of(model))


def palette_of(model: RobotModel) -> Array:
    """Black, then at most `MOST_COLOURS` colours of the parts, each as far as possible from the others, dark first."""
    colours = np.array([part.colour for part in model.parts], float)[:, :3]
    chosen = [colours[0]]
    while len(chosen) < MOST_COLOURS:
        apart = np.linalg.norm(colours[:, None] - np.array(chosen)[None], axis=2).min(1)
        if apart.max() < _SAME_COLOUR:
            break
        chosen.append(colours[apart.argmax()])
    chosen.sort(key=lambda colour: float(colour.sum()))
    return np.vstack([np.zeros(3), *chosen])
