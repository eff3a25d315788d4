"""A robot's triangles prepared for drawing: welded, sorted by link, with face planes and an edge list."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import InputError
from hecbench.robots.meshes import Part
from hecbench.robots.model import RobotModel
from hecbench.system.cache import Cache

Float = NDArray[np.float32]
Int = NDArray[np.int32]

_KEPT = Cache("meshes.sqlite", most_bytes=512 * 2**20)

WELD_M = 1e-6
FLAT_M = 1e-9
"""A neighbour whose far corner lies less than this below a face's plane continues it."""


@dataclass(frozen=True, eq=False)
class RenderMesh:
    """Everything about a robot that no pose changes. Links without visual parts own empty ranges.

    Attributes:
        vertices: (3, V) m, each in the frame of its own link, sorted by link.
        faces: (F, 3) vertices, counter-clockwise from outside, sorted by link.
        planes: (4, F): unit normal and offset; ``normal @ camera + offset > 0`` sees the face's front.
        edge_ends: (E, 2) vertices.
        edge_faces: (E, 2); both the same at an open or non-manifold edge.
        edge_kinds: ends of three ranges of edges: convex ones within a part, ones between two parts, open ones.
            Concave and flat edges within a part are left out: no contour is ever seen along them.
        vertex_start, face_start: (L + 1,) ranges of the links.
        face_part: (F,).
        part_link: (P,).
        colours: (P, 3) RGB in [0, 1].
        part_names: P names.
        error_m: no point of the surface is farther than this from the full model's.
    """

    vertices: Float
    faces: Int
    planes: Float
    edge_ends: Int
    edge_faces: Int
    edge_kinds: Int
    vertex_start: Int
    face_start: Int
    face_part: Int
    part_link: Int
    colours: NDArray[np.float64]
    part_names: tuple[str, ...]
    error_m: float

    @staticmethod
    def of(model: RobotModel, *, cell_m: float = 0.0) -> RenderMesh:
        """Prepare a model; a positive `cell_m` merges the vertices within such cells, for coarse images.

        Merging moves every vertex by at most `error_m`, which is measured, and a triangle of moved vertices stays
        within that distance of the old one: the silhouette moves by at most ``focal_px * error_m / depth_m``.
        """
        if not model.parts:
            raise InputError(f"{model.name} has no visual meshes to draw")
        used = [[part for part in model.parts if part.link == link] for link in model.links]
        welded = [_weld(parts, max(cell_m, WELD_M)) for parts in used]
        parts = [part for group in used for part in group]
        vertices = np.concatenate([link.vertices for link in welded])
        vertex_start = np.cumsum([0, *(len(link.vertices) for link in welded)])
        part_start = np.cumsum([0, *(len(group) for group in used)])
        faces = np.concatenate(
            [link.faces + first for link, first in zip(welded, vertex_start, strict=False)]
        )
        face_part = np.concatenate(
            [link.part + first for link, first in zip(welded, part_start, strict=False)]
        )
        planes = _planes(vertices, faces)
        edge_ends, edge_faces, edge_kinds = _edges(vertices, faces, planes, face_part)
        return RenderMesh(
            vertices=np.ascontiguousarray(vertices.T, np.float32),
            faces=faces.astype(np.int32),
            planes=planes.astype(np.float32),
            edge_ends=edge_ends.astype(np.int32),
            edge_faces=edge_faces.astype(np.int32),
            edge_kinds=edge_kinds.astype(np.int32),
            vertex_start=vertex_start.astype(np.int32),
            face_start=np.cumsum([0, *(len(link.faces) for link in welded)]).astype(np.int32),
            face_part=face_part.astype(np.int32),
            part_link=np.array([model.link_index(part.link) for part in parts], np.int32),
            colours=np.array([part.colour for part in parts]),
            part_names=tuple(part.name for part in parts),
            error_m=max(link.moved for link in welded),
        )

    @staticmethod
    def cached(model: RobotModel, *, cell_m: float = 0.0) -> RenderMesh:
        """The same as `of`, kept in the user's cache folder by the parts' content."""
        digest = hashlib.sha256(Path(__file__).read_bytes())
        digest.update(repr((model.name, model.links, cell_m)).encode())
        for part in model.parts:
            digest.update(repr((part.name, part.link, part.colour, part.vertices.shape)).encode())
            digest.update(np.ascontiguousarray(part.vertices).data)
            digest.update(np.ascontiguousarray(part.faces).data)
        key = digest.digest()
        if (kept := _KEPT.get(key)) is not None:
            with np.load(io.BytesIO(kept), allow_pickle=False) as arrays:
                held = dict(arrays)
            names, error_m = tuple(held.pop("part_names").tolist()), float(held.pop("error_m"))
            return RenderMesh(**held, part_names=names, error_m=error_m)
        mesh = RenderMesh.of(model, cell_m=cell_m)
        stream = io.BytesIO()
        np.savez(stream, **{item.name: getattr(mesh, item.name) for item in fields(mesh)})
        _KEPT.put({key: stream.getvalue()})
        return mesh

    def scaled(self, frame_T_link: NDArray[np.float64], scale: NDArray[np.float64]) -> RenderMesh:
        """The robot stretched by `scale` (3,) along the axes of a frame, at one configuration (L, 4, 4)."""
        vertices = self.vertices.T.astype(float)
        for link, (first, last) in enumerate(pairwise(self.vertex_start)):
            stretched = se3.transform_points(frame_T_link[link], vertices[first:last]) * scale
            vertices[first:last] = se3.transform_points(se3.inverse(frame_T_link[link]), stretched)
        planes = _planes(vertices, self.faces).astype(np.float32)
        return replace(self, vertices=np.ascontiguousarray(vertices.T, np.float32), planes=planes)


@dataclass(frozen=True)
class _Welded:
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    part: NDArray[np.int64]
    moved: float


def _weld(parts: Sequence[Part], cell_m: float) -> _Welded:
    """One link's parts with the vertices of each cell merged into the one nearest to their mean.

    The back of a surface that does not close has vertices of its own, so that its rim stays an open edge.
    """
    if not parts:
        return _Welded(np.zeros((0, 3)), np.zeros((0, 3), int), np.zeros(0, int), 0.0)
    vertices = np.concatenate([part.vertices for part in parts])
    first = np.cumsum([0, *(len(part.vertices) for part in parts)])
    faces = np.concatenate([part.faces + start for part, start in zip(parts, first, strict=False)])
    part = np.repeat(np.arange(len(parts)), [len(part.faces) for part in parts])
    side = np.zeros(len(vertices), np.int64)
    both = np.concatenate(
        [p.both_sides if len(p.both_sides) else np.zeros(len(p.faces), bool) for p in parts]
    )
    if both.any():
        faces = np.concatenate([faces, faces[both][:, ::-1] + len(vertices)])
        vertices, part = np.concatenate([vertices, vertices]), np.concatenate([part, part[both]])
        side = np.repeat([0, 1], len(side))
    cells = np.c_[np.round(vertices / cell_m).astype(np.int64), side]
    _, cell = np.unique(cells, axis=0, return_inverse=True)
    cell = cell.reshape(-1)
    count = np.bincount(cell)
    centre = np.stack([np.bincount(cell, vertices[:, axis]) / count for axis in range(3)], -1)
    off_centre = np.linalg.norm(vertices - centre[cell], axis=1)
    order = np.lexsort((off_centre, cell))
    kept = order[np.r_[0, np.cumsum(count)[:-1]]]
    moved = float(np.linalg.norm(vertices - vertices[kept][cell], axis=1).max())
    faces = cell[faces]
    whole = (faces != np.roll(faces, 1, axis=1)).all(1)
    vertices, faces, part = vertices[kept], faces[whole], part[whole]
    faces, part = _without_duplicates(faces, part)
    return _Welded(*_in_order_of_use(vertices, faces), part, moved)


def _without_duplicates(
    faces: NDArray[np.int64], part: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Faces that fell together with the same side outside are kept once."""
    turned = np.take_along_axis(faces, (faces.argmin(1)[:, None] + np.arange(3)) % 3, 1)
    _, kept = np.unique(turned, axis=0, return_index=True)
    kept.sort()
    return faces[kept], part[kept]


def _in_order_of_use(
    vertices: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices sorted by first use: neighbours in the face list are neighbours in memory."""
    used, place = np.unique(faces.reshape(-1), return_index=True)
    used = used[np.argsort(place)]
    renamed = np.empty(len(vertices), np.int64)
    renamed[used] = np.arange(len(used))
    return vertices[used], renamed[faces]


def _planes(vertices: NDArray[np.float64], faces: NDArray[np.integer]) -> NDArray[np.float64]:
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    return np.ascontiguousarray(np.c_[normal, -(normal * a).sum(1)].T)


def _edges(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    planes: NDArray[np.float64],
    face_part: NDArray[np.int64],
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Ends, faces and kinds of the edges. One of more than two faces is open on each of them."""
    ends = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(faces)), 3)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    ends, owner = ends[order], owner[order]
    starts = np.flatnonzero(np.r_[True, (ends[1:] != ends[:-1]).any(1)])
    count = np.diff(np.r_[starts, len(ends)])
    pair = starts[count == 2]
    pair = pair[np.argsort(owner[pair], kind="stable")]
    first, second = owner[pair], owner[pair + 1]
    between = face_part[first] != face_part[second]
    apex = vertices[faces[second]].sum(1) - vertices[ends[pair]].sum(1)
    height = (planes[:3, first] * apex.T).sum(0) + planes[3, first]
    convex = height < -FLAT_M
    within, across = pair[convex & ~between], pair[between]
    single = np.flatnonzero(np.repeat(count != 2, count))
    chosen = np.concatenate([within, across, single])
    other = np.concatenate([within + 1, across + 1, single])
    kinds = np.cumsum([len(within), len(across), len(single)])
    return ends[chosen], np.c_[owner[chosen], owner[other]], kinds
