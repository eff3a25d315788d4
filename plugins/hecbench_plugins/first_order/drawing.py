"""One view as the first-order methods draw it: the picture of a rectangle around the robot, and its derivative."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hecbench.rendering import Renderer, RenderMesh
from hecbench.robots.model import RobotModel
from hecbench.se3 import Array
from hecbench_plugins.first_order import kernels
from hecbench_plugins.views.pyramid import View, meshes_by_level

Picture = NDArray[np.float32]

MASK = np.array([[1.0], [0.0]], np.float32)
"""The colour table of a robot drawn as one mask."""


@dataclass(frozen=True)
class Box:
    """A rectangle of pixels, x1 and y1 inclusive; outside it a drawing shows the background."""

    x0: int
    x1: int
    y0: int
    y1: int

    @property
    def slices(self) -> tuple[slice, slice]:
        """Rows and columns."""
        return slice(self.y0, self.y1 + 1), slice(self.x0, self.x1 + 1)


class Drawer(Protocol):
    """What turns a pose into a picture and the slope of a loss by the picture into one by the pose."""

    width: int
    height: int
    box: Box | None
    """Around the robot in the last picture; None: it is not in the picture."""

    def draw(self, camera_T_parent: Array) -> Picture:
        """The picture (C, h, w) of `box`, or (C, 0, 0); the next call overwrites it."""
        ...

    def pull(self, slope: Picture) -> Array:
        """dL (6,) by a left perturbation [phi rad, rho m] of camera_T_parent, from dL (C, h, w) by the picture."""
        ...


class CpuDrawer:
    """Draws with one renderer, or with several whose robots are added up as if none hid another.

    Args:
        meshes: one for each renderer.
        colours: (P + 1, C) of the parts and the background, the same for every mesh.
        view: where the links are.
        K: (3, 3) px.
        width: of the image, px.
        height: of the image, px.
    """

    def __init__(
        self, meshes: Sequence[RenderMesh], colours: Picture, view: View, K: Array, width: int, height: int
    ) -> None:
        self.width, self.height = width, height
        self.box: Box | None = None
        self._renderers = [Renderer(mesh, K, width, height) for mesh in meshes]
        self._colours = np.ascontiguousarray(colours, np.float32)
        self._parent_T_link = view.parent_T_link
        self._buffer = np.zeros(colours.shape[1] * width * height, np.float32)

    def draw(self, camera_T_parent: Array) -> Picture:
        """See `Drawer`."""
        poses = camera_T_parent @ self._parent_T_link
        for renderer in self._renderers:
            renderer.draw(poses)
        boxes = [renderer.box.tolist() for renderer in self._renderers]
        boxes = [box for box in boxes if box[1] >= box[0]]
        channels = self._colours.shape[1]
        if not boxes:
            self.box = None
            return np.zeros((channels, 0, 0), np.float32)
        self.box = box = Box(
            max(min(box[0] for box in boxes) - 1, 0),
            min(max(box[1] for box in boxes) + 1, self.width - 1),
            max(min(box[2] for box in boxes) - 1, 0),
            min(max(box[3] for box in boxes) + 1, self.height - 1),
        )
        shape = (channels, box.y1 - box.y0 + 1, box.x1 - box.x0 + 1)
        picture = self._buffer[: math.prod(shape)].reshape(shape)
        self._area = np.array([box.x0, box.x1, box.y0, box.y1])
        for number, renderer in enumerate(self._renderers):
            found = renderer.crossings
            kernels.paint(
                renderer.face,
                renderer.mesh.face_part,
                self._colours,
                found.pixels,
                found.parts,
                found.mix,
                self._area,
                number == 0,
                picture,
            )
        return picture

    def pull(self, slope: Picture) -> Array:
        """See `Drawer`."""
        total = np.zeros(6)
        if self.box is None:
            return total
        for renderer in self._renderers:
            found = renderer.crossings
            kernels.pull(
                self.width,
                self._colours,
                found.pixels,
                found.parts,
                found.mix,
                found.point,
                found.gradient,
                self._area,
                slope,
                total,
            )
        return total


class BoxSum:
    """Sums of a field (H, W) over all pixels outside a rectangle, in constant time."""

    def __init__(self, field: NDArray[np.floating]) -> None:
        self._integral = np.zeros((field.shape[0] + 1, field.shape[1] + 1))
        self._integral[1:, 1:] = field.astype(float).cumsum(0).cumsum(1)

    @property
    def total(self) -> float:
        """Over all pixels."""
        return float(self._integral[-1, -1])

    def outside(self, box: Box | None) -> float:
        """Over the pixels outside `box`."""
        if box is None:
            return self.total
        table, x1, y1 = self._integral, box.x1 + 1, box.y1 + 1
        return self.total - float(
            table[y1, x1] - table[box.y0, x1] - table[y1, box.x0] + table[box.y0, box.x0]
        )


@lru_cache(maxsize=4)
def whole_mask_mesh(model: RobotModel) -> RenderMesh:
    """The robot as a single part."""
    return _one_part(meshes_by_level(model)[1])


@lru_cache(maxsize=4)
def link_mask_meshes(model: RobotModel) -> tuple[RenderMesh, ...]:
    """Every link that can be seen, as a robot of its own and a single part."""
    seen = dict.fromkeys(part.link for part in model.parts)
    return tuple(
        _one_part(RenderMesh.of(replace(model, parts=tuple(p for p in model.parts if p.link == link))))
        for link in seen
    )


def _one_part(mesh: RenderMesh) -> RenderMesh:
    """The mesh with all its parts as one: only what bounds the background is then an edge."""
    return replace(
        mesh,
        face_part=np.zeros_like(mesh.face_part),
        part_link=np.zeros(1, np.int32),
        colours=np.ones((1, 3)),
        part_names=("robot",),
    )
