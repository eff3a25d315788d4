"""The cell in 3D: the robot as it stands, the next pose as a ghost, the samples, the camera with its picture."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import HecbenchError
from hecbench.lens import CameraModel
from hecbench.recording import Mounting, Recording
from hecbench.report.viewer import ShownRobot, add_dots, place, vertical_view_rad
from hecbench.robots.posed import PosedRobot
from hecbench.se3 import Array

_GHOST_RGB, _SAMPLE_RGB, _CAMERA_RGB = (60, 130, 230), (20, 120, 60), (20, 120, 60)
_GHOST_OPACITY = 0.35
_CELL_M = 0.01
_UNSEEN = 1e-4
"""Change of a pose's numbers, rad or m, that no eye sees."""
_PLANE_M = 0.5
"""How far in front of the camera its picture hangs."""
_MARGIN = 1.1
"""Of the view through the camera, about its picture."""


class Scene:
    """What viser shows of a session, in the frame of the robot's base."""

    def __init__(self, server: Any, cell: Recording) -> None:
        self._server, self._cell = server, cell
        scene = server.scene
        scene.set_up_direction("+z")
        scene.add_grid("/floor", 4.0, 4.0, cell_size=0.25, section_size=1.0)
        scene.add_frame("/base", axes_length=0.15, axes_radius=0.004)
        self._flange = scene.add_frame("/flange", axes_length=0.08, axes_radius=0.003)
        self._robot = self._ghost = None
        try:
            self._posed: PosedRobot | None = PosedRobot.of(cell)
        except HecbenchError:  # poses alone: the flange's frame stands for the robot
            self._posed = None
        else:
            model = self._posed.model
            self._robot = ShownRobot(scene, "/robot", model, cell_m=_CELL_M)
            self._ghost = ShownRobot(scene, "/ghost", model, _GHOST_RGB, _GHOST_OPACITY, _CELL_M)
            self._ghost.hide()
        self._picture: Any = None
        self._shown: Array | None = None
        server.initial_camera.position = (1.8, 1.2, 1.2)
        server.initial_camera.look_at = (0.0, 0.0, 0.4)

    def show_robot(self, joints_rad: Array, base_T_flange: Array) -> None:
        """As it stands: joints (6,) rad, NaN where they are not known; a browser draws again only what has moved."""
        if self._shown is not None and np.abs(base_T_flange - self._shown).max() < _UNSEEN:
            return
        self._shown = base_T_flange
        place(self._flange, base_T_flange)
        if self._robot is not None and np.isfinite(joints_rad).all():
            self._robot.place(self._links(joints_rad, base_T_flange))

    def show_ghost(self, joints_rad: Array | None, base_T_flange: Array | None) -> None:
        """The next pose; None: there is none to show."""
        if self._ghost is None:
            return
        if joints_rad is None or base_T_flange is None:
            self._ghost.hide()
        else:
            self._ghost.place(self._links(joints_rad, base_T_flange))

    def _links(self, joints_rad: Array, base_T_flange: Array) -> Array:
        assert self._posed is not None
        moves = self._cell.mounting is Mounting.EYE_IN_HAND
        links = self._posed.link_poses(joints_rad)
        return np.asarray((base_T_flange if moves else np.eye(4)) @ links)

    def show_samples(self, base_T_flange: Array) -> None:
        """A dot at every flange pose (N, 4, 4) that is recorded."""
        if not len(base_T_flange):
            self._server.scene.remove_by_name("/samples")
            return
        add_dots(self._server.scene, "/samples", base_T_flange[:, :3, 3], _SAMPLE_RGB, 0.012)

    def show_camera(self, base_T_camera: Array, camera: CameraModel, image: NDArray[np.uint8]) -> Any:
        """The camera with its picture in front of it; returns the picture, which can be clicked."""
        width, height, centre = _plane(camera)
        self._server.scene.add_camera_frustum(
            "/camera",
            vertical_view_rad(camera),
            width / height,
            scale=0.12,
            color=_CAMERA_RGB,
            wxyz=se3.to_quat_wxyz(base_T_camera),
            position=base_T_camera[:3, 3],
        )
        base_T_picture = base_T_camera @ se3.make(np.eye(3), centre)
        if self._picture is None:
            self._picture = self._server.scene.add_image("/picture", image, width, height)
        self._picture.image = image
        place(self._picture, base_T_picture)
        return self._picture

    def look_through(self, base_T_camera: Array, camera: CameraModel) -> None:
        """Every browser looks through the camera at its picture."""
        _, _, centre = _plane(camera)
        for client in self._server.get_clients().values():
            with client.atomic():
                client.camera.fov = vertical_view_rad(camera, _MARGIN)
                client.camera.up_direction = -base_T_camera[:3, 1]
                client.camera.position = base_T_camera[:3, 3]
                client.camera.look_at = se3.transform_points(base_T_camera, centre)[0]


def _plane(camera: CameraModel) -> tuple[float, float, Array]:
    """Width, height and centre (3,) m, in the camera's frame, of the plane on which its picture hangs."""
    K = camera.intrinsics
    size = np.array([camera.width, camera.height])
    focal, principal = K[[0, 1], [0, 1]], K[:2, 2]
    width, height = _PLANE_M * size / focal
    return (
        float(width),
        float(height),
        np.array([*(_PLANE_M * ((size - 1) / 2 - principal) / focal), _PLANE_M]),
    )


def pixel_of(
    ray_origin: Array, ray_direction: Array, base_T_camera: Array, camera: CameraModel
) -> NDArray[np.float64]:
    """The pixel (2,) of the hanging picture that a ray (3,), (3,) of the base meets."""
    camera_T_base = se3.inverse(base_T_camera)
    origin = se3.transform_points(camera_T_base, np.asarray(ray_origin, float))[0]
    direction = camera_T_base[:3, :3] @ np.asarray(ray_direction, float)
    met = origin + (_PLANE_M - origin[2]) / direction[2] * direction
    K = camera.intrinsics
    return np.asarray(K[[0, 1], [0, 1]] * met[:2] / _PLANE_M + K[:2, 2])
