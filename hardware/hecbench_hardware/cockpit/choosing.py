"""Which robot and camera: named by the caller, or chosen on the page."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from threading import Event
from typing import Any, TypeVar

from hecbench import registry
from hecbench.errors import HecbenchError
from hecbench.specs import DeviceSpec, Kind
from hecbench_hardware.cockpit import texts

_TICK_S = 0.2

T = TypeVar("T")


@dataclass(frozen=True)
class Devices:
    """Names of plugins, and the controller's address where one is given."""

    robot: str
    camera: str
    host: str | None = None


def ask(server: Any, suggested: Devices, simulated_only: bool, use: Callable[[Devices], T]) -> T:
    """What `use` makes of what the person chose; its errors are shown, and another choice can be made."""
    gui, clicked = server.gui, Event()
    folder = gui.add_folder("cell")
    with folder:
        robots, cameras = (_names(kind, simulated_only) for kind in (Kind.ROBOT, Kind.CAMERA))
        robot = gui.add_dropdown("robot", robots, initial_value=suggested.robot)
        camera = gui.add_dropdown("camera", cameras, initial_value=suggested.camera)
        host = gui.add_text("controller's address", suggested.host or "", hint="of a real arm")
        said = gui.add_markdown("")
        gui.add_button("connect").on_click(lambda event: clicked.set())
    while True:
        while not clicked.wait(_TICK_S):  # in steps, so that Ctrl-C is heard
            pass
        clicked.clear()
        said.content = "connecting"
        try:
            used = use(Devices(robot.value, camera.value, host.value or None))
        except HecbenchError as error:
            said.content = texts.fault(error)
        else:
            folder.remove()
            return used


def _names(kind: Kind, simulated_only: bool) -> list[str]:
    ready = registry.load().ready(kind, DeviceSpec)
    return [spec.name for spec in ready if spec.simulated or not simulated_only]
