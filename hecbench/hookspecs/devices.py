"""Hooks of devices and of trials with them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from hecbench.hookspecs.marker import hookspec
from hecbench.specs import DeviceSpec

if TYPE_CHECKING:
    from hecbench.storage.trial_record import TrialRecord


@hookspec
def hecbench_robots() -> Iterable[DeviceSpec]:
    """Robot arms, simulated and real; the protocol is `hecbench_hardware.devices.Robot`.

    ```python
    import logging

    from hecbench.registry import hookimpl, load
    from hecbench.specs import DeviceSpec, Kind


    class Logged:
        '''The simulated UR5e, each motion written to the log before it begins.'''

        def __init__(self, options):
            self._robot = load().get(Kind.ROBOT, "sim_ur5e", DeviceSpec).open(options)

        def __getattr__(self, name):
            return getattr(self._robot, name)

        def move_joints(self, joints_rad, *, speed_rad_s=None):
            logging.getLogger(__name__).info("to joints %s", joints_rad)
            self._robot.move_joints(joints_rad, speed_rad_s=speed_rad_s)


    @hookimpl
    def hecbench_robots():
        yield DeviceSpec(
            name="logged_ur5e", kind=Kind.ROBOT, summary="sim_ur5e with a log", open=Logged, simulated=True
        )
    ```
    """
    raise NotImplementedError


@hookspec
def hecbench_grippers() -> Iterable[DeviceSpec]:
    """Grippers, simulated and real; the protocol is `hecbench_hardware.devices.Gripper`.

    ```python
    from hecbench.registry import hookimpl
    from hecbench.specs import DeviceSpec, Kind


    class Cup:
        '''A suction cup that is simulated: it holds whatever it is told to.'''

        name = "cup"

        def __init__(self):
            self._holding = False

        def enable(self):
            self._holding = False

        def open_fingers(self, width_m=None):
            self._holding = False

        def close_fingers(self, force_n=None):
            self._holding = True
            return self.status()

        def status(self):
            from hecbench_hardware.devices import GripperStatus

            return GripperStatus(width_m=None, moving=False, holding=self._holding)

        def stop(self):
            pass

        def close(self):
            pass


    @hookimpl
    def hecbench_grippers():
        yield DeviceSpec(
            name="cup", kind=Kind.GRIPPER, summary="a suction cup", open=lambda options: Cup(), simulated=True
        )
    ```
    """
    raise NotImplementedError


@hookspec
def hecbench_cameras() -> Iterable[DeviceSpec]:
    """Cameras, simulated and real; the protocol is `hecbench_hardware.devices.Camera`.

    ```python
    import time

    import numpy as np

    from hecbench.recording import CameraModel
    from hecbench.registry import hookimpl
    from hecbench.specs import DeviceSpec, Kind


    class Noise:
        '''A camera with its cap on.'''

        name = "noise"

        def __init__(self, options):
            self._rng = np.random.default_rng(int(options.get("seed", "0")))

        def grab(self, timeout_s=2.0):
            from hecbench_hardware.devices import Frame

            image = self._rng.integers(0, 8, (480, 640, 3), dtype=np.uint8)
            return Frame(image, time.time(), None, "noise")

        def intrinsics(self):
            return CameraModel(640, 480, np.array([[600.0, 0, 319.5], [0, 600, 239.5], [0, 0, 1]]))

        def close(self):
            pass


    @hookimpl
    def hecbench_cameras():
        yield DeviceSpec(
            name="noise", kind=Kind.CAMERA, summary="noise", open=Noise, simulated=True, options=("seed",)
        )
    ```
    """
    raise NotImplementedError


@hookspec
def hecbench_trial_finished(trial: TrialRecord) -> None:
    """Called after each trial, an aborted one too, once it is on disk; what it raises does not end the run.

    ```python
    import logging

    from hecbench.registry import hookimpl


    @hookimpl
    def hecbench_trial_finished(trial):
        logging.getLogger(__name__).warning("%s at place %d: %s", trial.task, trial.place, trial.outcome)
    ```
    """
    raise NotImplementedError
