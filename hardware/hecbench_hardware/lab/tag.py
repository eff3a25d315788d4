"""AprilTags as geometry: coplanar black and white squares, so that no texture filter moves an edge."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hecbench.se3 import Array
from hecbench.targets import AprilTagTarget
from hecbench_hardware.tag_edges import cells


def meshes(target: AprilTagTarget) -> dict[bool, tuple[Array, NDArray[np.int32]]]:
    """Vertices (V, 3) m in the tag's frame and faces (F, 3) of the white (True) and the black (False) squares.

    A white margin of one cell surrounds the tag. Faces are counter-clockwise seen from the front (z < 0).
    """
    white = np.pad(cells(target.family, target.id), 1, constant_values=True)
    count = len(white)
    edges = (np.arange(count + 1) - count / 2) * target.size_m / (count - 2)
    y, x = np.meshgrid(edges, edges, indexing="ij")
    vertices = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    found = {}
    for colour in (True, False):
        row, column = np.nonzero(white == colour)
        corner = row * (count + 1) + column
        below = corner + count + 1
        faces = np.concatenate(
            [np.column_stack([corner, below + 1, corner + 1]), np.column_stack([corner, below, below + 1])]
        )
        used, compact = np.unique(faces, return_inverse=True)
        found[colour] = vertices[used], compact.reshape(-1, 3).astype(np.int32)
    return found
