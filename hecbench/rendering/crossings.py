"""Where visible edges of a robot cross between pixel centres: what the derivative of a picture needs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hecbench.rendering.mesh import Float, Int, RenderMesh


@dataclass(frozen=True, eq=False)
class Crossings:
    """C places where a visible edge crosses the segment between two neighbouring pixel centres p and q, at t.

    Attributes:
        pixels: (C, 2) flat indices of p and q; q is right of p or below it.
        parts: (C, 2) of p and q, -1 for the background.
        link: (C,) that the edge belongs to, and moves with.
        t: (C,) in [0, 1], px from p.
        point: (C, 3) m on the edge, camera frame.
        gradient: (C, 3) px/m: dt by the motion of the point in the camera frame.
        slope: (C,) of the edge, columns per row for horizontal pairs, rows per column for vertical ones.
        mix: (C, 4): share of q's colour in p, its derivative by -t; share of p's colour in q, its derivative by t.
    """

    pixels: Int
    parts: Int
    link: Int
    t: Float
    point: Float
    gradient: Float
    slope: Float
    mix: Float

    def __len__(self) -> int:
        return len(self.link)

    @property
    def horizontal(self) -> NDArray[np.bool_]:
        """Which pairs (C,) are horizontal."""
        return np.asarray(self.pixels[:, 1] - self.pixels[:, 0] == 1)

    def pose_columns(self) -> NDArray[np.float64]:
        """dt (C, 6) px by a left perturbation [phi rad, rho m] of camera_T_robot."""
        gradient = self.gradient.astype(float)
        return np.concatenate([np.cross(self.point.astype(float), gradient), gradient], 1)


class Edges(NamedTuple):
    """What the loops over edges read of a mesh."""

    ends: Int
    """(E, 2) vertices."""
    faces: Int
    """(E, 2), see `RenderMesh`."""
    kinds: Int
    face_part: Int
    face_link: Int

    @classmethod
    def of(cls, mesh: RenderMesh) -> Edges:
        """Of a mesh."""
        face_link = mesh.part_link[mesh.face_part]
        return cls(mesh.edge_ends, mesh.edge_faces, mesh.edge_kinds, mesh.face_part, face_link)


class CrossingBuffers(NamedTuple):
    """What the loops over edges write, with room for C crossings in a picture (H, W)."""

    best: Int
    """(2, H, W) scratch: the crossing found so far between a pixel and the next one right or below."""
    taken: Float
    """(2 H W,) scratch, zero between calls."""
    pair: Int
    """(C,) flat index into `best`."""
    place: Float
    """(C, 2): t in [0, 1] between the centres, and the parameter along the edge on the screen."""
    edge: Int
    """(C,)"""
    ends: Int
    """(C, 4): the two pixels (flat) and their parts, -1 = background."""
    link: Int
    """(C,) of the edge."""
    point: Float
    """(C, 3) m on the edge in the camera frame."""
    gradient: Float
    """(C, 3) px/m = dt/dpoint."""
    slope: Float
    """(C,) columns per row, or rows per column."""
    mix: Float
    """(C, 4): what each pixel takes of the other's colour and how that changes with t."""

    @classmethod
    def of(cls, width: int, height: int) -> CrossingBuffers:
        """For pictures of this size."""
        room = max(4096, width * height // 4)
        return cls(
            best=np.zeros((2, height, width), np.int32),
            taken=np.zeros(2 * width * height, np.float32),
            pair=np.zeros(room, np.int32),
            place=np.zeros((room, 2), np.float32),
            edge=np.zeros(room, np.int32),
            ends=np.zeros((room, 4), np.int32),
            link=np.zeros(room, np.int32),
            point=np.zeros((room, 3), np.float32),
            gradient=np.zeros((room, 3), np.float32),
            slope=np.zeros(room, np.float32),
            mix=np.zeros((room, 4), np.float32),
        )

    def first(self, count: int) -> Crossings:
        """Views of the first so many."""
        return Crossings(
            pixels=self.ends[:count, :2],
            parts=self.ends[:count, 2:],
            link=self.link[:count],
            t=self.place[:count, 0],
            point=self.point[:count],
            gradient=self.gradient[:count],
            slope=self.slope[:count],
            mix=self.mix[:count],
        )
