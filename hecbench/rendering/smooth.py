"""Vertex normals for shading, continuous within smooth surfaces and broken at creases."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hecbench.rendering.mesh import Float, Int, RenderMesh

CREASE_RAD = np.deg2rad(40)
"""Neighbouring faces whose normals differ by more do not belong to one smooth surface."""


@dataclass(frozen=True, eq=False)
class Normals:
    """Unit `vectors` (3, N), each in its link's frame, and `faces` (F, 3): which belong to a face's corners."""

    vectors: Float
    faces: Int


@lru_cache(maxsize=4)
def normals(mesh: RenderMesh) -> Normals:
    """Means of the face normals around each vertex within a smooth surface, by the angle of each face there."""
    vertices, faces, facing = mesh.vertices.T.astype(float), mesh.faces.astype(np.int64), mesh.planes[:3].T
    surface = _surfaces(faces, facing, mesh.face_part)
    corner = vertices[faces]
    sides = np.roll(corner, -1, 1) - corner
    sides /= np.maximum(np.linalg.norm(sides, axis=2, keepdims=True), 1e-12)
    angle = np.arccos(np.clip(-(sides * np.roll(sides, 1, 1)).sum(2), -1, 1))
    key = faces * (surface.max() + 1) + surface[:, None]
    _, index = np.unique(key.reshape(-1), return_inverse=True)
    index = index.reshape(faces.shape)
    total = np.zeros((index.max() + 1, 3))
    np.add.at(total, index, angle[:, :, None] * facing[:, None])
    opposed = np.linalg.norm(total, axis=1)[index] < 1e-6
    total[index[opposed]] = facing[np.nonzero(opposed)[0]]
    total /= np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)
    return Normals(np.ascontiguousarray(total.T, np.float32), index.astype(np.int32))


def _surfaces(
    faces: NDArray[np.int64], facing: NDArray[np.float32], face_part: NDArray[np.int32]
) -> NDArray[np.int64]:
    """A number (F,) per face, the same for faces of one part that are connected without a crease."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    ends = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(faces)), 3)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    ends, owner = ends[order], owner[order]
    meet = (ends[1:] == ends[:-1]).all(1)
    first, second = owner[:-1][meet], owner[1:][meet]
    smooth = (facing[first] * facing[second]).sum(1) > np.cos(CREASE_RAD)
    smooth &= face_part[first] == face_part[second]
    links = coo_matrix((np.ones(smooth.sum()), (first[smooth], second[smooth])), (len(faces),) * 2)
    return np.asarray(connected_components(links, directed=False)[1], np.int64)
