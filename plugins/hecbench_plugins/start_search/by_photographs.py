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
from hecbench.samples.spread import evenly
from hecbench.se3 import Array
from hecbench.system import threads
from hecbench_plugins.start_search.kernels import coverage
from hecbench_plugins.start_search.settings import PHOTOGRAPHS
from hecbench_plugins.start_search.view_sphere import ViewSphere, best_apart, look_at


def starts(
    meshes: tuple[RenderMesh, RenderMesh],
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
        meshes: of the robot, for the coarse and the finer drawings.
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
    views = evenly(len(parent_T_link), PHOTOGRAPHS.views)
    seen = K, valid, parent_T_link[views], foreground[views]
    _, costs = _shifted(meshes[0], seen, poses, PHOTOGRAPHS.coarse_px)
    better = np.sort(costs.argsort(kind="stable")[: max(count, round(PHOTOGRAPHS.better * len(poses)))])
    found, costs = _shifted(meshes[1], seen, poses[better], PHOTOGRAPHS.width_px)
    return [found[i] for i in best_apart(list(found), list(-costs), count, PHOTOGRAPHS.apart)]


def _shifted(
    mesh: RenderMesh,
    seen: tuple[Array, NDArray[np.bool_], Array, NDArray[np.float32]],
    poses: Array,
    width: int,
) -> tuple[Array, Array]:
    """The poses (n, 4, 4), each turned to where the photographs changed, and the costs (n,) of that."""
    shifts = [_Shifts(mesh, *seen, width) for _ in range(min(threads.count(), len(poses)))]
    pairs = zip(shifts, np.array_split(poses, len(shifts)), strict=True)
    rays, costs = zip(*threads.each(lambda pair: pair[0](pair[1]), pairs), strict=True)
    return _turn_to(np.concatenate(rays)) @ poses, np.concatenate(costs)


def _moving(parent_T_link: Array) -> tuple[Array, float]:
    """The middle (3,) m of the links' origins in the parent's frame, and their largest extent, m."""
    points = parent_T_link[..., :3, 3].reshape(-1, 3)
    return points.mean(0), float(np.ptp(points, axis=0).max())


class _Shifts:
    """For poses that look at the robot, the turns of the camera that put it where the photographs changed."""

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
        from scipy import fft

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
        self._gain = fft.rfft2(gain)
        self._covered = np.zeros((PHOTOGRAPHS.batch, *gain.shape), np.float32)
        self._ray_of = np.linalg.inv(self._K)

    def __call__(self, camera_T_parents: Array) -> tuple[Array, Array]:
        """Rays (n, 3), x, y, 1, to turn the optical axes of poses (n, 4, 4) to, and costs (n,); of no robot: 0."""
        batches = range(0, len(camera_T_parents), len(self._covered))
        found = [self._best(camera_T_parents[first : first + len(self._covered)]) for first in batches]
        rays, costs = (np.concatenate(column) for column in zip(*found, strict=True))
        return rays, costs

    def _best(self, camera_T_parents: Array) -> tuple[Array, Array]:
        from scipy import fft

        renderer, covered = self._renderer, self._covered[: len(camera_T_parents)]
        coverage(renderer.scene, renderer.sight, camera_T_parents, self._parent_T_link, covered)
        spectra = (fft.rfft2(covered).conj() * self._gain).sum(1)
        costs = fft.irfft2(spectra, self._size).reshape(len(covered), -1)
        best = costs.argmin(1)
        places = np.stack(np.unravel_index(best, self._size), 1)
        size = np.array(self._size)
        shifts = np.where(places > size / 2, places - size, places)[:, ::-1]
        at = np.column_stack([self._middle + shifts, np.ones(len(covered))])
        return at @ self._ray_of.T, costs[np.arange(len(covered)), best]


def _turn_to(rays: Array) -> Array:
    """The turns (n, 4, 4) about the camera's centre that bring what is on the optical axis onto rays (x, y, 1)."""
    axes = np.cross([0.0, 0.0, 1.0], rays)
    sines = np.linalg.norm(axes, axis=1, keepdims=True)
    angles = np.arctan2(sines, rays[:, 2:])
    return se3.from_rotvec(axes * (angles / np.maximum(sines, 1e-12)), np.zeros(3))
