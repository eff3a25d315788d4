"""The lab as a place for trials: the workpiece stands where it is put, and geometry judges."""

from __future__ import annotations

import numpy as np

from hecbench import se3
from hecbench.recording import CameraModel
from hecbench.se3 import Array
from hecbench_hardware import tags
from hecbench_hardware.cameras.lab import LabCamera
from hecbench_hardware.devices import Gripper, Robot
from hecbench_hardware.lab.arm import LabGripper
from hecbench_hardware.lab.cells import Station
from hecbench_hardware.lab.eye import Eye, Sensor
from hecbench_hardware.tag_edges import TagRefused
from hecbench_hardware.trials import physics, solids, sweep
from hecbench_hardware.trials.cell import Calibration, NotSeen, Stroke
from hecbench_hardware.trials.tasks import Task, Verdict


def lab_camera(station: Station, model: CameraModel, sensor: Sensor, seed: int) -> LabCamera:
    """A camera that sees the workpiece and the arm."""
    eye = Eye(station.scene(workpiece=True), model, sensor, whole=False)
    return LabCamera(eye, station.camera_pose(0), station.home_rad, seed)


class LabCell:
    """Any robot whose arm is the station's: the lab's own, or a real driver on a simulated controller.

    One picture is taken for each calibration and place, the same for every method that is tried there.
    """

    places = 3

    def __init__(
        self, station: Station, robot: Robot, camera: LabCamera | None, seed: int = 0, dynamics: bool = False
    ) -> None:
        """Without a camera the pose of the tag is exact; `seed` draws the noise of the pictures; `dynamics` judges
        grasps by lifting the block.
        """
        self.station, self.robot, self.camera = station, robot, camera
        self.name = station.name
        self.shape, self.home_rad = station.gripper, station.home_rad
        gripper = LabGripper(
            f"gripper lab {self.shape.name}", self.shape.opening_m, 2 * solids.BLOCK_HALF_M[0]
        )
        gripper.holds = self._block_between_pads
        self.gripper: Gripper = gripper
        self._workpiece = station.workpiece_pose(0)
        self._camera_pose = station.camera_pose(0)
        self._seed, self._dynamics = seed, dynamics
        self._setting = 0, 0
        self._seen: dict[tuple[int, int], Array] = {}
        if camera is not None:
            camera.follow(robot)

    def prepare(self, calibration: Calibration, place: int) -> None:
        """Put the workpiece at a place and the camera where the calibration was made."""
        self._setting = calibration.number, place
        self._workpiece = self.station.workpiece_pose(place)
        self._camera_pose = self.station.camera_pose(calibration.number)
        if self.camera is not None:
            self.camera.base_T_workpiece = self._workpiece
            self.camera.base_T_camera = self._camera_pose
            self.camera.rng = np.random.default_rng([self._seed, *self._setting, 4])

    def locate(self) -> Array:
        """From the picture, or the truth where nothing is drawn."""
        if self.camera is None:
            return self.truth()[1]
        if self._setting not in self._seen:
            model = self.camera.intrinsics()
            assert model is not None
            try:
                found = tags.locate(self.camera.grab().image, model, solids.TAG)
            except TagRefused as refusal:
                raise NotSeen(str(refusal)) from None
            self._seen[self._setting] = found.camera_T_tag
        return self._seen[self._setting]

    def judge(self, task: Task, stroke: Stroke, clearance_m: float) -> Verdict:
        """By the contact sweep along the true path, or by dynamics."""
        path = se3.inverse(self._workpiece) @ stroke.base_T_tool
        if self._dynamics and task is Task.GRASP:
            return physics.lift(path, self.shape)
        return sweep.judge(task, path, self.shape, clearance_m)

    def truth(self) -> tuple[Array, Array]:
        """base_T_workpiece and camera_T_tag (4, 4) m."""
        return self._workpiece, np.asarray(
            se3.inverse(self._camera_pose) @ self._workpiece @ solids.workpiece_T_tag()
        )

    def _block_between_pads(self) -> bool:
        tool = self.robot.state().base_T_flange @ self.shape.flange_T_tool
        end = se3.inverse(self._workpiece) @ tool
        return sweep.judge(Task.GRASP, end[None], self.shape).success
