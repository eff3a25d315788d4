"""The robot's silhouette in the pixels of a recording's own images, lens and all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import InputError, Refusal
from hecbench.lens import undistort
from hecbench.recording import CameraModel, Recording
from hecbench.rendering import Renderer
from hecbench.rendering.undistort import shrunk_intrinsics
from hecbench.se3 import Array
from hecbench_plugins.views.pyramid import meshes_by_level, photographed_robot
from hecbench_plugins.views.settings import CANVAS

Mask = NDArray[np.bool_]


class Silhouettes:
    """Draws the robot of a recording as masks.

    Args:
        recording: with a robot model, joints and intrinsics.
        shrink: pixels of the recording per pixel of the masks.

    Raises:
        Refusal: one of these is not there.
    """

    def __init__(self, recording: Recording, shrink: int = 1) -> None:
        try:
            robot = photographed_robot(recording)
            self.samples = robot.samples
            """Rows that have joints; the others cannot be drawn."""
            poses = robot.link_poses(robot.joints_rad[self.samples])
        except InputError as error:
            raise Refusal(f"{recording.name}: {error}") from error
        camera, meshes = recording.present.camera, meshes_by_level(robot.model)
        self._parent_T_link = dict(zip(self.samples.tolist(), poses, strict=True))
        small = _shrunk(camera, shrink)
        self._source, K, width, height = _canvas(small)
        mesh = meshes[max(level for level in meshes if level <= shrink)]
        self._renderer = Renderer(mesh, K, width, height)

    def draw(self, sample: int, parent_T_camera: Array) -> Mask:
        """Where (H, W) the robot is drawn for one sample; every call returns a new array."""
        self._renderer.rasterise(se3.inverse(parent_T_camera) @ self._parent_T_link[sample])
        drawn = self._renderer.face >= 0
        return drawn if self._source is None else np.asarray(drawn[self._source])

    def reach(self, sample: int, starts: Sequence[Array]) -> Mask:
        """Where (H, W) the robot is drawn from any of several parent_T_camera."""
        return np.asarray(np.logical_or.reduce([self.draw(sample, start) for start in starts]))


def _shrunk(camera: CameraModel, shrink: int) -> CameraModel:
    K = shrunk_intrinsics(camera.intrinsics, 1 / shrink)
    return replace(camera, width=camera.width // shrink, height=camera.height // shrink, K=K)


def _canvas(camera: CameraModel) -> tuple[tuple[NDArray[np.intp], NDArray[np.intp]] | None, Array, int, int]:
    """For each pixel (H, W) of the image its row and column on a pinhole canvas; K, width, height of that canvas.

    None instead of rows and columns when the image is the canvas. A barrel lens sees more than the pinhole of the same
    size: the canvas is as wide as needed, up to `widest`.
    """
    width, height = camera.width, camera.height
    if camera.is_pinhole:
        return None, camera.intrinsics, width, height
    v, u = np.mgrid[0:height, 0:width].astype(float)
    rays = np.stack([u, v, np.ones_like(u)], -1) @ np.linalg.inv(camera.intrinsics).T
    ideal = undistort(rays[..., :2], camera) @ camera.intrinsics[:2, :2].T + camera.intrinsics[:2, 2]
    ideal = np.nan_to_num(ideal, nan=np.inf)
    size = np.array([width, height])
    margin = (CANVAS.widest - 1) / 2 * size
    low = np.floor(np.maximum(ideal.min((0, 1)), -margin)).astype(int)
    high = np.ceil(np.minimum(ideal.max((0, 1)), size - 1 + margin)).astype(int)
    place = np.clip(np.rint(ideal), low, high).astype(int) - low
    K = camera.intrinsics.copy()
    K[:2, 2] -= low
    return (place[..., 1], place[..., 0]), K, int(high[0] - low[0] + 1), int(high[1] - low[1] + 1)
