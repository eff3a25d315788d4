"""The arm of the lab, driven directly: it is where it is told to be at once, within the same limits."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from hecbench.errors import InputError
from hecbench.se3 import Array
from hecbench_hardware.clearance import check_motion
from hecbench_hardware.devices import GripperStatus, RobotState
from hecbench_hardware.lab.cells import Station
from hecbench_hardware.limits import Sphere
from hecbench_hardware.motions import JointMotion, LineMotion, Motion, six_joints


class LabRobot:
    """Follows the `Robot` protocol without a controller."""

    simulated = True

    def __init__(self, station: Station) -> None:
        """The arm stands in its home pose."""
        self.name = f"lab {station.name}"
        self.station = station
        self.arm, self.limits = station.arm, station.limits
        self.enabled = False
        self._joints = station.home_rad.copy()
        self._begun = time.monotonic()

    def enable(self) -> None:
        """Take control."""
        self.enabled = True

    def carry(self, balls: tuple[Sphere, ...]) -> None:
        """Check every motion for these balls of the flange frame too."""
        self.limits = replace(self.limits, tool=self.limits.tool + balls)

    def state(self) -> RobotState:
        """Where the arm was put."""
        base_T_flange = self.arm.forward(self._joints)
        return RobotState(
            joints_rad=self._joints.copy(),
            joint_speeds_rad_s=np.zeros(len(self._joints)),
            base_T_flange=base_T_flange,
            nominal_base_T_flange=base_T_flange,
            base_T_tcp=base_T_flange,
            wrench=np.zeros(6),
            robot_stamp_s=time.monotonic() - self._begun,
            host_stamp_s=time.time(),
            speed_fraction=1.0,
        )

    def move_joints(self, joints_rad: Array, *, speed_rad_s: float | None = None) -> None:
        """To joints (6,) rad, after the limits were checked on the way."""
        self._follow(JointMotion(self.arm, self._joints, six_joints(joints_rad)))

    def move_linear(self, base_T_flange: Array, *, speed_m_s: float | None = None) -> None:
        """Straight to a flange pose (4, 4), after the limits were checked on the way."""
        self._follow(LineMotion(self.arm, self._joints, np.asarray(base_T_flange, float)))

    def _follow(self, motion: Motion) -> None:
        if not self.enabled:
            raise InputError(f"{self.name} is read-only: enable it first")
        check_motion(self.arm, motion, self.limits)
        self._joints = motion.joints[-1].copy()

    def settle(self, timeout_s: float = 5.0) -> RobotState:
        """It always stands still."""
        return self.state()

    def stop(self) -> None:
        """It always stands still."""

    @contextmanager
    def freedrive(self) -> Iterator[None]:
        """Nobody can guide it by hand."""
        raise InputError(f"{self.name} cannot be guided by hand: give a plan with joints")
        yield

    def recover(self, acknowledge: Callable[[str], bool]) -> bool:
        """Nothing to recover from."""
        return True

    def describe(self) -> dict[str, Any]:
        """The arm's name."""
        return {"model": self.arm.name, "simulated": True, "lab": self.station.name}

    def close(self) -> None:
        """Nothing to let go of."""


class LabGripper:
    """Opens and closes at once; it holds the block when `holds` says that it lies between the pads."""

    simulated = True

    def __init__(self, name: str, opening_m: float, block_m: float) -> None:
        """`block_m` is the width at which a closing gripper stops when there is something between the pads."""
        self.name = name
        self._opening_m, self._block_m = opening_m, block_m
        self._width_m = opening_m
        self.holds: Callable[[], bool] = lambda: False

    def enable(self) -> None:
        """Nothing real can move."""

    def open_fingers(self, width_m: float | None = None) -> None:
        """Open."""
        self._width_m = self._opening_m if width_m is None else width_m

    def close_fingers(self, force_n: float | None = None) -> GripperStatus:
        """Close."""
        self._width_m = self._block_m if self.holds() else 0.0
        return self.status()

    def status(self) -> GripperStatus:
        """Still."""
        return GripperStatus(self._width_m, moving=False, holding=self._width_m == self._block_m)

    def stop(self) -> None:
        """It always stands still."""

    def close(self) -> None:
        """Nothing to let go of."""
