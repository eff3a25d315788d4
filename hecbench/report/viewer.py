"""A recording in 3D: the robot at each sample, the target, and the camera where every method places it (viser)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import HecbenchError, InputError
from hecbench.estimate import Estimate
from hecbench.lens import CameraModel
from hecbench.recording import Mounting, Recording
from hecbench.rendering import RenderMesh
from hecbench.robots.model import RobotModel
from hecbench.robots.posed import PosedRobot
from hecbench.running.isolation import stdout_to_stderr
from hecbench.se3 import Array
from hecbench.system import files
from hecbench.system.wording import significant

_BOLD_RGB, _RIVAL_RGB, _TARGET_RGB = (20, 120, 60), (150, 160, 175), (255, 120, 30)
_FRUSTUM_M = 0.12
_WIDEST_PX = 640
_CELL_M = 0.003


class ShownRobot:
    """The meshes of a robot model in a scene of viser, all in one colour where one is given.

    They are simplified by `cell_m`, so that a browser without a graphics card turns them smoothly.
    """

    def __init__(
        self,
        scene: Any,
        name: str,
        model: RobotModel,
        colour: tuple[int, int, int] | None = None,
        opacity: float | None = None,
        cell_m: float = _CELL_M,
    ) -> None:
        mesh = RenderMesh.cached(model, cell_m=cell_m)
        self._meshes: list[tuple[int, Any]] = []
        for part, link in enumerate(mesh.part_link):
            used, faces = np.unique(mesh.faces[mesh.face_part == part], return_inverse=True)
            shown = scene.add_mesh_simple(
                f"{name}/{part}",
                mesh.vertices.T[used],
                faces.reshape(-1, 3),
                color=colour or tuple(round(255 * value) for value in mesh.colours[part]),
                opacity=opacity,
            )
            self._meshes.append((int(link), shown))

    def place(self, base_T_link: Array) -> None:
        """Show it with its links at (L, 4, 4) m."""
        for link, mesh in self._meshes:
            place(mesh, base_T_link[link])
            mesh.visible = True

    def fade(self, opacity: float) -> None:
        """From 0, not to be seen, to 1."""
        for _, mesh in self._meshes:
            mesh.opacity = opacity

    def hide(self) -> None:
        """Show nothing until it is placed again."""
        for _, mesh in self._meshes:
            mesh.visible = False


@dataclass(eq=False)
class Stage:
    """What a viser server shows of a prepared recording; everything in the frame of the robot's base.

    Attributes:
        server: of viser.
        recording: with robot poses.
        estimates: with answers; the first is drawn bold and carries the photograph.
    """

    server: Any
    recording: Recording
    estimates: Sequence[Estimate]
    _links: Array | None = field(default=None, init=False)
    _robot: ShownRobot | None = field(default=None, init=False)
    _frusta: list[Any] = field(default_factory=list, init=False)

    def __post_init__(self) -> None:
        scene = self.server.scene
        scene.set_up_direction("+z")
        scene.add_frame("/base", axes_length=0.15, axes_radius=0.004)
        self._add_robot()
        for number, estimate in enumerate(self.estimates):
            self._add_camera(number, estimate)
        self._add_controls()
        self._look_on()
        self.show(int(self.samples[0]))

    @property
    def samples(self) -> NDArray[np.int64]:
        """Those with a robot pose."""
        return np.flatnonzero(np.isfinite(self.recording.present.base_T_flange).all((1, 2)))

    def _look_on(self) -> None:
        """The first view: from above the side, far enough to hold the robot and the recommended camera."""
        X = self.estimates[0].pose
        hands = self.recording.present.base_T_flange[self.samples, :3, 3]
        away = X[:3, 3] if self.recording.mounting is Mounting.EYE_TO_HAND else hands[0]
        middle = (hands.mean(0) + away) / 2
        reach = max(float(np.linalg.norm(away - hands.mean(0))), 1.0)
        self.server.initial_camera.look_at = middle
        self.server.initial_camera.position = middle + reach * np.array([1.0, 0.3, 0.7])

    def _add_robot(self) -> None:
        """The links' meshes, where the model and the joints are known."""
        try:
            robot = PosedRobot.of(self.recording)
        except HecbenchError:  # a recording of poses alone: the flange's frame stands for the robot
            self.server.scene.add_frame("/flange", axes_length=0.1, axes_radius=0.003)
            return
        self._links = robot.link_poses(robot.joints_rad)
        self._robot = ShownRobot(self.server.scene, "/robot", robot.model)

    def _add_camera(self, number: int, estimate: Estimate) -> None:
        camera = estimate.camera or self.recording.camera
        fov, aspect = 0.8, 4 / 3
        if camera is not None:
            aspect = camera.width / camera.height
        if camera is not None and camera.K is not None:
            fov = vertical_view_rad(camera)
        frustum = self.server.scene.add_camera_frustum(
            f"/cameras/{estimate.solver}",
            fov,
            aspect,
            scale=_FRUSTUM_M * (1.5 if number == 0 else 1.0),
            thickness=4.0 if number == 0 else 1.5,
            thickness_units="screen",
            color=_BOLD_RGB if number == 0 else _RIVAL_RGB,
        )
        frustum.on_click(lambda event, name=estimate.solver: self._say_distances(name))
        self._frusta.append(frustum)

    def _add_controls(self) -> None:
        gui = self.server.gui
        slider = gui.add_slider("sample", 0, len(self.samples) - 1, 1, 0) if len(self.samples) > 1 else None
        opacity = gui.add_slider("robot's opacity", 0.1, 1.0, 0.05, 1.0)
        self._text = gui.add_markdown(f"**{self.estimates[0].solver}** bold; click a camera for distances")
        if slider is not None:
            slider.on_update(lambda event: self.show(int(self.samples[slider.value])))
        if (robot := self._robot) is not None:
            opacity.on_update(lambda event: robot.fade(opacity.value))

    def _say_distances(self, solver: str) -> None:
        centres = {
            e.solver: e.parent_T_camera[:3, 3] for e in self.estimates if e.parent_T_camera is not None
        }
        rows = [
            f"- {name}: {significant(1e3 * float(np.linalg.norm(centre - centres[solver])))} mm"
            for name, centre in centres.items()
            if name != solver
        ]
        self._text.content = f"**{solver}**: camera centres apart\n" + "\n".join(rows)

    def show(self, sample: int) -> None:
        """Place everything as it was at a sample."""
        flange = self.recording.present.base_T_flange[sample]
        moves = self.recording.mounting is Mounting.EYE_IN_HAND
        base_T_parent = flange if moves else np.eye(4)
        if self._robot is not None and self._links is not None:
            self._robot.place(base_T_parent @ self._links[sample])
        for frustum, estimate in zip(self._frusta, self.estimates, strict=True):
            place(frustum, base_T_parent @ estimate.pose)
        self._frusta[0].image = self._photograph(sample)
        self._show_target(flange if not moves else np.eye(4))

    def _show_target(self, base_T_carrier: Array) -> None:
        target, placed = self.recording.target, self.estimates[0].carrier_T_target
        if target is None or placed is None:
            return
        points = se3.transform_points(base_T_carrier @ placed, target.points_m)
        add_dots(self.server.scene, "/target", points, _TARGET_RGB, 0.004)

    def _photograph(self, sample: int) -> NDArray[np.uint8] | None:
        if self.recording.images is None or self.recording.images[sample] is None:
            return None
        picture = self.recording.image(sample)
        step = max(1, picture.shape[1] // _WIDEST_PX)
        return np.ascontiguousarray(picture[::step, ::step])

    def save(self, path: Path) -> None:
        """The scene as one file that opens without hecbench: ``.html``, or viser's own ``.viser``."""
        serializer = self.server.get_scene_serializer()
        if path.suffix == ".html":
            files.write_text(path, serializer.as_html())
        elif path.suffix == ".viser":
            files.write_bytes(path, serializer.serialize())
        else:
            raise InputError(f"--save {path}: give a name that ends in .html or .viser")

    def close(self) -> None:
        """End the server."""
        close_server(self.server)


def place(handle: Any, base_T_thing: Array) -> None:
    """Put something of a scene at a pose (4, 4) m."""
    handle.wxyz, handle.position = se3.to_quat_wxyz(base_T_thing), base_T_thing[:3, 3]


def add_dots(scene: Any, name: str, points_m: Array, colour: tuple[int, int, int], size_m: float) -> None:
    """Points (N, 3) of a scene, all in one colour."""
    colours = np.tile(np.array(colour, np.uint8), (len(points_m), 1))
    scene.add_point_cloud(name, points_m.astype(np.float32), colours, point_size=size_m)


def vertical_view_rad(camera: CameraModel, margin: float = 1.0) -> float:
    """The vertical angle of view of `margin` times the height of a camera's image."""
    return 2 * float(np.arctan(margin * camera.height / 2 / camera.intrinsics[1, 1]))


def open_server(host: str, port: int) -> Any:
    """A viser server.

    Raises:
        InputError: viser is not installed.
    """
    try:
        import viser
    except ImportError:
        raise InputError("the 3D page needs viser: pip install 'hecbench[viewer]'") from None
    with stdout_to_stderr():  # it greets
        return viser.ViserServer(host=host, port=port, verbose=False)


def close_server(server: Any) -> None:
    """End a viser server."""
    with stdout_to_stderr():  # it says so
        server.stop()
