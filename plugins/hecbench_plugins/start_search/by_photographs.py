"""A start from photographs alone: camera poses all over a view sphere, judged by which pixels changed.

The measure is the motion consistency of `search`, which needs no masks and no colours but a fixed camera and three
views or more. Direction, roll and distance are tried on a lattice. Where the robot lies in the image is found for each
of them at once: the cost is linear in what is covered, so its change by a shift of the drawings is a correlation.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.rendering import Renderer, RenderMesh
from hecbench.rendering.undistort import shrunk_intrinsics
from hecbench.se3 import Array
from hecbench.system import threads
from hecbench_plugins.start_search.kernels import coverage
from hecbench_plugins.start_search.settings import PHOTOGRAPHS
from hecbench_plugins.start_search.view_sphere import ViewSphere, best_apart, look_at


def starts(
    mesh: RenderMesh,
    K: Array,
    valid: NDArray[np.bool_],
    parent_T_link: Array,
    foreground: NDArray[np.float32],
    sphere: ViewSphere,
    count: int,
    distances_m: Sequence[float] | None = None,
) -> list[Array]:
    """The best camera_T_parent (4, 4), best first, distinct, for the search to begin at.

    Args:
        mesh: of the robot, coarse.
        K: (3, 3) px of the fixed camera.
        valid: (H, W) where its pictures say something.
        parent_T_link: (N, L, 4, 4) m; the z of the parent frame points up.
        foreground: (N, H, W) how unlike the background each pixel is.
        sphere: directions and rolls to try.
        count: how many to return.
        distances_m: of the camera from the middle of the moving links; without them 1.2 to 4.9 times their extent.
    """
    middle, span = _moving(parent_T_link)
    if distances_m is None:
        distances_m = [factor * span for factor in PHOTOGRAPHS.distances]
    centre = np.array([0.0, 0.0, 1.0])
    rotations = sphere.rotations()
    poses = np.concatenate([look_at(rotations, middle, centre, distance) for distance in distances_m])
    views = np.unique(np.linspace(0, len(parent_T_link) - 1, PHOTOGRAPHS.views).round().astype(int))
    seen = K, valid, parent_T_link[views], foreground[views]
    _, costs = _shifted(mesh, seen, poses, PHOTOGRAPHS.coarse_px)
    better = np.sort(costs.argsort(kind="stable")[: max(count, round(PHOTOGRAPHS.better * len(poses)))])
    found, costs = _shifted(mesh, seen, poses[better], PHOTOGRAPHS.width_px)
    return [found[i] for i in best_apart(list(found), list(-costs), count, PHOTOGRAPHS.apart)]


def _shifted(
    mesh: RenderMesh,
    seen: tuple[Array, NDArray[np.bool_], Array, NDArray[np.float32]],
    poses: Array,
    width: int,
) -> tuple[Array, Array]:
    """The poses (n, 4, 4), each turned to where the photographs changed, and the costs (n,) of that."""
    shifts = [_Shifts(mesh, *seen, width) for _ in range(threads.count())]
    pairs = zip(shifts, np.array_split(poses, len(shifts)), strict=True)
    shares = threads.each(lambda pair: [pair[0](pose) for pose in pair[1]], pairs)
    rays, costs = zip(*(row for share in shares for row in share), strict=True)
    return _turn_to(np.array(rays)) @ poses, np.array(costs)


def _moving(parent_T_link: Array) -> tuple[Array, float]:
    """The middle (3,) m of the links' origins in the parent's frame, and their largest extent, m."""
    points = parent_T_link[..., :3, 3].reshape(-1, 3)
    return points.mean(0), float(np.ptp(points, axis=0).max())


class _Shifts:
    """For a pose that looks at the robot, the turn of the camera that puts it where the photographs changed."""

    def __init__(
        self,
        mesh: RenderMesh,
        K: Array,
        valid: NDArray[np.bool_],
        parent_T_link: Array,
        foreground: NDArray[np.float32],
        width: int,
    ) -> None:
        import cv2

        self._parent_T_link = parent_T_link
        height = round(width * valid.shape[0] / valid.shape[1])
        self._K = shrunk_intrinsics(K, width / valid.shape[1], height / valid.shape[0])
        self._size = (2 * height, 2 * width)
        self._middle = np.array([width - 0.5, height - 0.5])
        drawn_K = self._K.copy()
        drawn_K[:2, 2] = self._middle
        self._renderer = Renderer(mesh, drawn_K, 2 * width, 2 * height)
        gain = np.zeros((len(parent_T_link), *self._size), np.float32)
        for view, changed in enumerate(foreground):
            small = cv2.resize(changed, (width, height), interpolation=cv2.INTER_AREA)
            gain[view, :height, :width] = PHOTOGRAPHS.unchanged_cost * (1 - small) - small
        inside = cv2.resize(valid.astype(np.float32), (width, height), interpolation=cv2.INTER_AREA)
        gain[:, :height, :width] *= inside > 0.9
        self._gain = np.fft.rfft2(gain)
        self._covered = np.zeros_like(gain)
        self._ray_of = np.linalg.inv(self._K)

    def __call__(self, camera_T_parent: Array) -> tuple[Array, float]:
        """The ray (x, y, 1) to turn the optical axis to, and its cost; the cost of a robot that is nowhere is 0."""
        renderer = self._renderer
        coverage(renderer.scene, renderer.sight, camera_T_parent, self._parent_T_link, self._covered)
        spectrum = (np.fft.rfft2(self._covered).conj() * self._gain).sum(0)
        costs = np.fft.irfft2(spectrum, self._size)
        best = np.unravel_index(costs.argmin(), self._size)
        row, column = (
            place - size if place > size / 2 else place for place, size in zip(best, self._size, strict=True)
        )
        at = self._middle + np.array([column, row])
        return self._ray_of @ np.array([*at, 1.0]), float(costs[best])


def _turn_to(rays: Array) -> Array:
    """The turns (n, 4, 4) about the camera's centre that bring what is on the optical axis onto rays (x, y, 1)."""
    axes = np.cross([0.0, 0.0, 1.0], rays)
    sines = np.linalg.norm(axes, axis=1, keepdims=True)
    angles = np.arctan2(sines, rays[:, 2:])
    return se3.from_rotvec(axes * (angles / np.maximum(sines, 1e-12)), np.zeros(3))
