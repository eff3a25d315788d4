# mypy: disable-error-code="no-untyped-def"
"""Surface normals of a drawn robot at each pixel centre, for lamps that do not stand at the camera."""

from __future__ import annotations

import numba
import numpy as np

from hecbench.rendering.mesh import Float
from hecbench.rendering.renderer import Renderer
from hecbench.rendering.smooth import Normals


def normal_map(renderer: Renderer, known: Normals) -> Float:
    """Unit normals (H, W, 3), camera frame, of the last pose that was rasterised; 0 where no face is seen."""
    out = np.zeros((*renderer.face.shape, 3), np.float32)
    surface = renderer.sight.screen, renderer.mesh.faces, renderer.face, renderer.edges.face_link
    _interpolate(*surface, known.vectors, known.faces, renderer.sight.camera_T_link, renderer.box, out)
    return out


@numba.njit(fastmath=True, cache=True, nogil=True, boundscheck=False)
def _interpolate(screen, faces, face, face_link, vectors, corners, camera_T_link, box, out):  # noqa: ANN001, ANN202
    for y in range(box[2], box[3] + 1):
        for x in range(box[0], box[1] + 1):
            f = face[y, x]
            if f < 0:
                continue
            a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
            u, v = np.float32(x) + np.float32(0.5), np.float32(y) + np.float32(0.5)
            ax, bx, cx = screen[0, a], screen[0, b], screen[0, c]
            ay, by, cy = screen[1, a], screen[1, b], screen[1, c]
            scale = np.float32(1) / ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))
            w0 = ((u - cx) * (by - cy) + (v - cy) * (cx - bx)) * scale
            w1 = ((u - cx) * (cy - ay) + (v - cy) * (ax - cx)) * scale
            w2 = (np.float32(1) - w0 - w1) * screen[2, c]
            w0, w1 = w0 * screen[2, a], w1 * screen[2, b]
            i, j, k = corners[f, 0], corners[f, 1], corners[f, 2]
            p = w0 * vectors[0, i] + w1 * vectors[0, j] + w2 * vectors[0, k]
            q = w0 * vectors[1, i] + w1 * vectors[1, j] + w2 * vectors[1, k]
            r = w0 * vectors[2, i] + w1 * vectors[2, j] + w2 * vectors[2, k]
            scale = np.float32(1) / np.sqrt(p * p + q * q + r * r + np.float32(1e-20))
            T = camera_T_link[face_link[f]]
            for row in range(3):
                out[y, x, row] = (T[row, 0] * p + T[row, 1] * q + T[row, 2] * r) * scale
