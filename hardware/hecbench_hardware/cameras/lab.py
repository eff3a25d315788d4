"""The camera of the virtual lab: any size, optics and noise, following whatever arm it is shown."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import CameraModel, Mounting, Recording
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import DeviceSpec, Kind
from hecbench_hardware.devices import Frame, Robot
from hecbench_hardware.options import number, text
from hecbench_hardware.trials import solids


class LabCamera:
    """Draws the lab as it is at the moment: `follow` a robot, real, simulated or the lab's own."""

    def __init__(self, eye: Any, base_T_camera: Array, home_rad: Array, seed: int = 0) -> None:
        """`eye` draws; `base_T_camera` (4, 4) is where it stands."""
        self.name = "camera lab"
        self.eye = eye
        self.base_T_camera = base_T_camera
        self.base_T_workpiece: Array | None = None
        self._home_rad = home_rad
        self._robot: Robot | None = None
        self.rng = np.random.default_rng(seed)
        self._count = 0

    def follow(self, robot: Robot) -> None:
        """Draw the arm where this robot says that it is."""
        self._robot = robot

    def joints_rad(self) -> Array:
        """(6,) of the arm in the picture."""
        return self._home_rad if self._robot is None else self._robot.state().joints_rad

    def grab(self, timeout_s: float = 2.0) -> Frame:
        """The picture now."""
        self.eye.scene.place(self.joints_rad(), self.base_T_workpiece)
        image = self.eye.image(self.base_T_camera, self.rng, self._tag_m())
        self._count += 1
        return Frame(image, time.time(), None, f"lab {self._count:06d}")

    def _tag_m(self) -> Array | None:
        """The corners of the workpiece's tag (4, 3) m in the base, which deserve the finest pixels."""
        if self.base_T_workpiece is None:
            return None
        base_T_tag = self.base_T_workpiece @ solids.workpiece_T_tag()
        return se3.transform_points(base_T_tag, solids.TAG.points_m)

    def with_truth(self, recording: Recording) -> Recording:
        """The recording with the robot's mask of every picture and the camera's true pose, saved in its folder."""
        from hecbench.storage import recording_io

        masks = []
        for joints in recording.present.joints_rad:
            self.eye.scene.place(joints, self.base_T_workpiece)
            masks.append(self.eye.mask(self.base_T_camera).astype(np.uint8) * np.uint8(255))
        complete = replace(recording, masks=tuple(masks), truth_parent_T_camera=self.base_T_camera)
        recording_io.save(complete, recording.present.folder)
        return complete

    def intrinsics(self) -> CameraModel | None:
        """Exactly what it draws with."""
        camera: CameraModel = self.eye.camera
        return camera

    def close(self) -> None:
        """Give the graphics back."""
        self.eye.close()


def open_camera(options: Mapping[str, str]) -> LabCamera:
    """The camera of one of the lab's calibrations; `cell`, a recording, gives other optics and another place."""
    from hecbench.storage import recording_io
    from hecbench_hardware.lab import cells
    from hecbench_hardware.lab.eye import Eye, Sensor

    station = cells.station(options.get("arm", "ur5e"), options.get("urdf"))
    calibration = int(number(options, "calibration", 0))
    model = cells.camera_model(int(number(options, "width", 2448)), int(number(options, "height", 2048)))
    base_T_camera = station.camera_pose(calibration)
    if "cell" in options:
        cell = recording_io.load(Path(text(options, "cell")))
        if cell.camera is None or cell.camera.K is None or cell.mounting is not Mounting.EYE_TO_HAND:
            raise InputError(f"cell={options['cell']}: needs a camera with K beside the arm, eye_to_hand")
        model = cell.camera
        base_T_camera = (
            cell.initial_parent_T_camera if cell.initial_parent_T_camera is not None else base_T_camera
        )
    sensor = Sensor(int(number(options, "supersample", 2)), number(options, "noise", 0.0))
    scene = station.scene(flange_tag=station.flange_tag(calibration))
    seed = int(number(options, "seed", 0))
    return LabCamera(Eye(scene, model, sensor), base_T_camera, station.home_rad, seed)


@hookimpl
def hecbench_cameras() -> Iterable[DeviceSpec]:
    """The camera."""
    yield DeviceSpec(
        name="lab",
        kind=Kind.CAMERA,
        summary="the virtual lab's camera; it draws the arm wherever the robot of the recording is",
        imports=("mujoco",),
        open=open_camera,
        simulated=True,
        options=("arm", "urdf", "calibration", "cell", "width", "height", "supersample", "noise", "seed"),
    )
