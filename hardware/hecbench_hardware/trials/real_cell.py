"""A real table: the operator puts the workpiece down, the gripper says what it holds, the arm where it stopped."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hecbench.recording import CameraModel
from hecbench.se3 import Array
from hecbench_hardware import tags
from hecbench_hardware.devices import Camera, Gripper, Robot
from hecbench_hardware.tag_edges import TagRefused
from hecbench_hardware.trials import solids
from hecbench_hardware.trials.cell import Calibration, NotSeen, Stroke
from hecbench_hardware.trials.tasks import Task, Verdict


class RealCell:
    """Devices behind the usual protocols; nothing is known but what they report."""

    def __init__(
        self,
        robot: Robot,
        gripper: Gripper,
        camera: Camera,
        model: CameraModel,
        shape: solids.Gripper,
        *,
        places: int,
        ask: Callable[[str], bool],
    ) -> None:
        """`ask` is answered by the operator; the arm's present pose is its home."""
        self.name = robot.name
        self.robot, self.gripper, self.shape, self.places = robot, gripper, shape, places
        self.home_rad = np.asarray(robot.state().joints_rad, float)
        self._camera, self._model, self._ask = camera, model, ask

    def prepare(self, calibration: Calibration, place: int) -> None:
        """Ask for the workpiece."""
        if not self._ask(f"Put the workpiece at place {place + 1} of {self.places}. Done?"):
            raise NotSeen(f"the workpiece is not at place {place + 1}: put it there and go on with --resume")

    def locate(self) -> Array:
        """From one picture."""
        try:
            return tags.locate(self._camera.grab().image, self._model, solids.TAG).camera_T_tag
        except TagRefused as refusal:
            raise NotSeen(str(refusal)) from None

    def judge(self, task: Task, stroke: Stroke, clearance_m: float) -> Verdict:
        """A grasp holds after the lift; an insertion that came to its end without a stop is one."""
        if task is Task.GRASP and not stroke.lifted.holding:
            return Verdict(False, "the gripper holds nothing after the lift", float("nan"))
        return Verdict(True, "", float("nan"))

    def truth(self) -> None:
        """Unknown."""
        return None
