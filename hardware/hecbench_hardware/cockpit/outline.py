"""The robot's contour in the picture, where the calibration so far puts it."""

from __future__ import annotations

import numpy as np

from hecbench import se3
from hecbench.lens import project
from hecbench.recording import Recording
from hecbench.rendering import Renderer, RenderMesh
from hecbench.rendering.undistort import shrunk_intrinsics
from hecbench.robots.posed import PosedRobot
from hecbench.se3 import Array

_CELL_M = 0.004
_WIDEST_PX = 640


class Outline:
    """Draws the robot of a cell at most 640 px wide.

    Raises:
        InputError: the cell has no robot model, or the camera's K is not known.
    """

    def __init__(self, cell: Recording) -> None:
        self._robot, self._camera = PosedRobot.of(cell), cell.present.camera
        width, height = self._camera.width, self._camera.height
        shrink = max(1.0, width / _WIDEST_PX)
        K = shrunk_intrinsics(self._camera.intrinsics, 1 / shrink)
        mesh = RenderMesh.cached(self._robot.model, cell_m=_CELL_M)
        self._ray_of = np.linalg.inv(K)
        self._renderer = Renderer(mesh, K, round(width / shrink), round(height / shrink))

    def pixels(self, joints_rad: Array, parent_T_camera: Array) -> Array:
        """(P, 2) px of the contour with joints (6,) rad and the camera (4, 4) m there."""
        links = self._robot.clipped_link_poses(joints_rad)
        self._renderer.draw(se3.inverse(parent_T_camera) @ links)
        crossings = self._renderer.crossings
        contour = np.unique(crossings.pixels[(crossings.parts < 0).any(1)])
        rows, columns = np.divmod(contour, self._renderer.face.shape[1])
        rays = np.stack([columns, rows, np.ones(len(contour))], 1) @ self._ray_of.T
        return project(self._camera, rays)
