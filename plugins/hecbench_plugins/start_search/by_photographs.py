"""A start from photographs alone: camera poses all over a view sphere, judged by which pixels changed.

The measure is the motion consistency of `search`, which needs no masks and no colours but a fixed camera and three
views or more. Direction, roll and distance are tried on a lattice. Where the robot lies in the image is found for each
of them at once: the cost is linear in what is covered, so its change by a shift of the drawings is a correlation.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hecbench import se3, threads
from hecbench.rendering import Renderer, RenderMesh
from hecbench.rendering.undistort import shrunk_intrinsics
from hecbench_plugins.start_search.view_sphere import ViewSphere, best_apart, look_at
from hecbench_plugins.views.canvas import Canvas

Array = NDArray[np.float64]

_DISTANCES = (1.2, 1.6, 2.1, 2.8, 3.7, 4.9)
"""Of the camera, in spans of the moving links."""
_WIDTH_PX = 80
_VIEWS = 5
_UNCHANGED_COST = 0.7
_APART = 0.2


def starts(
    mesh: RenderMesh,
    canvas: Canvas,
    foreground: NDArray[np.float32],
    sphere: ViewSphere,
    count: int,
) -> list[Array]:
    """The best camera_T_parent (4, 4), best first, distinct, for the search to begin at.

    Args:
        mesh: of the robot, coarse.
        canvas: of a fixed camera; the z of its parent frame points up.
        foreground: (N, H, W) how unlike the background each pixel is.
        sphere: directions and rolls to try.
        count: how many to return.
    """
    views = np.unique(np.linspace(0, len(canvas) - 1, _VIEWS).round().astype(int))
    middle, span = _moving(canvas)
    shifts = [_Shifts(mesh, canvas.subset(views), foreground[views]) for _ in range(threads.count())]
    centre = np.array([0.0, 0.0, 1.0])
    rotations = sphere.rotations()
    poses = np.concatenate([look_at(rotations, middle, centre, factor * span) for factor in _DISTANCES])
    pairs = zip(shifts, np.array_split(poses, threads.count()), strict=True)
    shares = threads.each(lambda pair: [pair[0](pose) for pose in pair[1]], pairs)
    rows = [row for share in shares for row in share]
    found = [pose for pose, _ in rows]
    return [found[i] for i in best_apart(found, [-cost for _, cost in rows], count, _APART)]


def _moving(canvas: Canvas) -> tuple[Array, float]:
    """The middle (3,) m of the links' origins in the parent's frame, and their largest extent, m."""
    points = canvas.parent_T_link[..., :3, 3].reshape(-1, 3)
    return points.mean(0), float(np.ptp(points, axis=0).max())


class _Shifts:
    """For a pose that looks at the robot, the turn of the camera that puts it where the photographs changed."""

    def __init__(self, mesh: RenderMesh, canvas: Canvas, foreground: NDArray[np.float32]) -> None:
        import cv2

        self._canvas = canvas
        height, width = round(_WIDTH_PX * canvas.valid.shape[0] / canvas.valid.shape[1]), _WIDTH_PX
        self._K = shrunk_intrinsics(canvas.K, width / canvas.valid.shape[1], height / canvas.valid.shape[0])
        self._size = (2 * height, 2 * width)
        self._middle = np.array([width - 0.5, height - 0.5])
        drawn_K = self._K.copy()
        drawn_K[:2, 2] = self._middle
        self._renderer = Renderer(mesh, drawn_K, 2 * width, 2 * height)
        gain = np.zeros((len(canvas), *self._size), np.float32)
        for view, changed in enumerate(foreground):
            small = cv2.resize(changed, (width, height), interpolation=cv2.INTER_AREA)
            gain[view, :height, :width] = _UNCHANGED_COST * (1 - small) - small
        valid = cv2.resize(canvas.valid.astype(np.float32), (width, height), interpolation=cv2.INTER_AREA)
        gain[:, :height, :width] *= valid > 0.9
        self._gain = np.fft.rfft2(gain)

    def __call__(self, camera_T_parent: Array) -> tuple[Array, float]:
        """The turned pose and its cost; the cost of a robot that is nowhere is 0."""
        covered = np.zeros((len(self._canvas), *self._size), np.float32)
        for view, links in enumerate(self._canvas.parent_T_link):
            self._renderer.rasterise(camera_T_parent @ links)
            covered[view] = self._renderer.face >= 0
        covered[:, covered.all(0)] = 0
        spectrum = (np.fft.rfft2(covered).conj() * self._gain).sum(0)
        costs = np.fft.irfft2(spectrum, self._size)
        best = np.unravel_index(costs.argmin(), self._size)
        row, column = (
            place - size if place > size / 2 else place for place, size in zip(best, self._size, strict=True)
        )
        turn = _turn_to(np.linalg.solve(self._K, [*(self._middle + np.array([column, row])), 1.0]))
        return turn @ camera_T_parent, float(costs[best])


def _turn_to(ray: Array) -> Array:
    """The turn (4, 4) about the camera's centre that brings what is on the optical axis onto a ray (x, y, 1)."""
    axis = np.cross([0.0, 0.0, 1.0], ray)
    sine = np.linalg.norm(axis)
    angle = np.arctan2(sine, ray[2])
    return se3.make(se3.so3_exp(axis * (angle / max(sine, 1e-12))), np.zeros(3))
