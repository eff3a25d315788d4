"""The tab that verifies: a click in the picture gives base coordinates, and an armed tool goes there."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.se3 import Array
from hecbench_hardware.cockpit.pointing import Pointed, Pointer
from hecbench_hardware.cockpit.scene import Scene, pixel_of
from hecbench_hardware.cockpit.seeing import small
from hecbench_hardware.cockpit.session import FEWEST, Now, Session

Ask = Callable[[Callable[[], str]], object]

_EVERY_S = 2.0
"""The hanging picture is renewed, which is slow in a browser without a graphics card."""
_SPOT_RGB = (230, 60, 40)


class PointingTab:
    """Points with the recommended answer, on a horizontal plane whose height the person gives."""

    def __init__(self, server: Any, session: Session, scene: Scene, ask: Ask, beside: Ask) -> None:
        """`ask` lets the page do something and say how it ended; `beside` the same beside the live picture."""
        self._server, self._session, self._scene, self._ask = server, session, scene, ask
        self._pointed: Pointed | None = None
        self._clickable = False
        self._shown_s = -np.inf
        gui = server.gui
        gui.add_markdown(
            "Click a point of the picture. The point is taken on a horizontal plane of this height."
        )
        self._height = gui.add_number("height above the base, m", 0.0, step=0.001)
        look = gui.add_button("look through the camera")
        self._pixel = gui.add_vector2("pixel u, v", (0.0, 0.0), step=1.0)
        point = gui.add_button("point at this pixel")
        self._text = gui.add_markdown("no point is chosen yet")
        self._above = gui.add_number("tool above the point, m", 0.1, min=0.0, max=0.5, step=0.01)
        go = gui.add_button("move the tool there")
        go.visible = session.driven
        look.on_click(lambda event: ask(self._look))
        point.on_click(lambda event: ask(lambda: self._point(np.array(self._pixel.value))))
        go.on_click(lambda event: beside(self._move))

    def show(self, now: Now) -> None:
        """The camera with its newest picture, once there is an answer."""
        pointer = self._session.pointer()
        if pointer is None or now.state is None or time.monotonic() - self._shown_s < _EVERY_S:
            return
        self._shown_s = time.monotonic()
        base_T_camera = self._session.base_T_parent(now.state) @ pointer.estimate.pose
        picture = self._scene.show_camera(base_T_camera, pointer.camera, small(now.image))
        if not self._clickable:
            self._clickable = True
            picture.on_click(self._clicked)

    def _known(self) -> tuple[Pointer, Array]:
        """What points, and base_T_parent now."""
        if (pointer := self._session.pointer()) is None:
            raise InputError(
                f"there is no answer to point with: record {FEWEST} samples, or finish, with camera.K in the cell"
            )
        return pointer, self._session.base_T_parent(self._session.robot.state())

    def _clicked(self, event: Any) -> None:
        def point() -> str:
            pointer, base_T_parent = self._known()
            base_T_camera = base_T_parent @ pointer.estimate.pose
            ray = np.array(event.ray_origin), np.array(event.ray_direction)
            return self._point(pixel_of(*ray, base_T_camera, pointer.camera))

        self._ask(point)

    def _look(self) -> str:
        pointer, base_T_parent = self._known()
        self._scene.look_through(base_T_parent @ pointer.estimate.pose, pointer.camera)
        return "this is what the camera sees"

    def _point(self, pixel: Array) -> str:
        pointer, base_T_parent = self._known()
        pointed = self._pointed = pointer.at(pixel, base_T_parent, self._height.value)
        self._pixel.value = (float(pixel[0]), float(pixel[1]))
        self._server.scene.add_icosphere("/pointed", 0.008, color=_SPOT_RGB, position=pointed.base_m)
        self._text.content = str(pointed)
        return f"pixel {pixel[0]:.0f}, {pixel[1]:.0f}: {pointed}"

    def _move(self) -> str:
        if self._pointed is None:
            raise InputError("no point is chosen: click one in the picture first")
        state = self._session.robot.state()
        flange_T_tool = se3.inverse(state.base_T_flange) @ state.base_T_tcp
        aim_m = self._pointed.base_m + np.array([0.0, 0.0, self._above.value])
        base_T_tool = se3.make(state.base_T_tcp[:3, :3], aim_m)
        self._session.robot.move_linear(base_T_tool @ se3.inverse(flange_T_tool))
        return f"the tool is {100 * self._above.value:.0f} cm above the point"
