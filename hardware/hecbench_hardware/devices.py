"""The small protocols that every robot, gripper and camera follows, real or simulated, and the named faults.

Units are SI; transforms are ``a_T_b``. `base` is the controller's base frame, `flange` its tool flange
(tool0), `tcp` the tool centre point that is set on the controller.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import HecbenchError
from hecbench.recording import CameraModel, Recording
from hecbench.se3 import Array
from hecbench_hardware.kinematics import Arm
from hecbench_hardware.limits import Limits, Sphere


class Fault(StrEnum):
    """The states in which a device can end, other than done."""

    PROTECTIVE_STOP = "protective_stop"
    EMERGENCY_STOP = "emergency_stop"
    SAFETY_STOP = "safety_stop"
    POWER_OFF = "power_off"
    LINK_LOST = "link_lost"
    STALE = "stale"
    LOCAL_MODE = "local_mode"
    BUSY = "busy"
    PROGRAM_ENDED = "program_ended"
    FORCE = "force"
    LATE = "late"
    STOPPED = "stopped"
    OFF_TARGET = "off_target"
    GRIPPER = "gripper"
    CAMERA = "camera"


CURES = {
    Fault.PROTECTIVE_STOP: "find what the arm met, then acknowledge to unlock it",
    Fault.EMERGENCY_STOP: "make the cell safe, release the button, then acknowledge to power the arm on",
    Fault.SAFETY_STOP: "clear the safeguard or the violation on the pendant",
    Fault.POWER_OFF: "power the arm on and release its brakes on the pendant",
    Fault.LINK_LOST: "check the cable and that the controller is on",
    Fault.STALE: "check the network and the load of this computer",
    Fault.LOCAL_MODE: "switch the pendant to remote control",
    Fault.BUSY: "stop the other program or client first",
    Fault.PROGRAM_ENDED: "the target may be out of reach or beyond a singularity: see the pendant's log",
    Fault.FORCE: "find what the tool pushes against",
    Fault.LATE: "check the speed slider and what holds the arm back",
    Fault.STOPPED: "start again when ready",
    Fault.OFF_TARGET: "check the pendant's log, then move again",
    Fault.GRIPPER: "check its power, cable and fingers",
    Fault.CAMERA: "check its cable and that no other program uses it",
}
"""What the operator does about each fault."""


class DeviceFault(HecbenchError):
    """A device stopped in a named state; the message is one line with the cure."""

    def __init__(self, fault: Fault, device: str, detail: str) -> None:
        """`device` says which one, `detail` what was seen."""
        super().__init__(f"{device}: {fault.replace('_', ' ')}, {detail}: {CURES[fault]}")
        self.fault = fault


@dataclass(frozen=True)
class RobotState:
    """The arm at one moment."""

    joints_rad: Array
    """(6,)"""
    joint_speeds_rad_s: Array
    """(6,)"""
    base_T_flange: Array
    """(4, 4), the controller's, with its factory calibration; ours while the tool offset is unknown."""
    nominal_base_T_flange: Array
    """(4, 4), our forward kinematics of the joints with nominal lengths."""
    base_T_tcp: Array
    """(4, 4), the controller's."""
    wrench: Array
    """(6,) N and Nm at the tool, base axes."""
    robot_stamp_s: float
    """The controller's clock."""
    host_stamp_s: float
    """This computer's clock, seconds since 1970, when the state arrived."""
    speed_fraction: float
    """The speed slider, 0 to 1."""


class Robot(Protocol):
    """An arm. Motions return when the arm has arrived and raise `DeviceFault` when it has not."""

    name: str
    simulated: bool
    limits: Limits
    """Bounds of every motion, with everything that the flange carries."""

    @property
    def arm(self) -> Arm:
        """Its kinematics."""
        ...

    @property
    def enabled(self) -> bool:
        """Whether it can be moved from here, or only read."""
        ...

    def enable(self) -> None:
        """Take control. Only `arming.take_control` calls this, so that nothing moves unasked."""
        ...

    def carry(self, balls: tuple[Sphere, ...]) -> None:
        """Check every motion for these balls of the flange frame too, a gripper's."""
        ...

    def state(self) -> RobotState:
        """The newest state; raises `DeviceFault` when there is none fresh enough."""
        ...

    def move_joints(self, joints_rad: Array, *, speed_rad_s: float | None = None) -> None:
        """Straight in joint space to joints (6,) rad."""
        ...

    def move_linear(self, base_T_flange: Array, *, speed_m_s: float | None = None) -> None:
        """Straight in space to a flange pose (4, 4)."""
        ...

    def settle(self, timeout_s: float = 5.0) -> RobotState:
        """Wait until the arm stands still and return its state then."""
        ...

    def stop(self) -> None:
        """Brake; from any thread. The motion that was interrupted raises `DeviceFault`."""
        ...

    def freedrive(self) -> AbstractContextManager[None]:
        """The arm can be guided by hand inside the block."""
        ...

    def recover(self, acknowledge: Callable[[str], bool]) -> bool:
        """After a fault: ask the operator, make ready again. False when the operator says no."""
        ...

    def describe(self) -> dict[str, Any]:
        """What a recording should remember about this arm: plain values."""
        ...

    def close(self) -> None:
        """Let go of the arm, standing still. May be called twice."""
        ...


@dataclass(frozen=True)
class GripperStatus:
    """A gripper at one moment."""

    width_m: float | None
    """Between the finger pads; None when the device cannot tell."""
    moving: bool
    holding: bool
    """The fingers stopped on something before their target."""


class Gripper(Protocol):
    """Two fingers. Commands return when the fingers stand and raise `DeviceFault` when they do not.

    Opening the device only connects: before `enable` nothing is sent that could move fingers, and every command that
    would is refused with an `InputError`.
    """

    name: str

    def enable(self) -> None:
        """Make it ready, which may move the fingers. Only `arming.take_control` calls this, after the arm's."""
        ...

    def open_fingers(self, width_m: float | None = None) -> None:
        """Open fully, or to a width."""
        ...

    def close_fingers(self, force_n: float | None = None) -> GripperStatus:
        """Close until the pads meet something or each other."""
        ...

    def status(self) -> GripperStatus:
        """What it does now."""
        ...

    def stop(self) -> None:
        """Hold the fingers where they are; nothing before `enable`."""
        ...

    def close(self) -> None:
        """Disconnect; the fingers stay. May be called twice."""
        ...


@dataclass(frozen=True)
class Frame:
    """One image with both clocks."""

    image: NDArray[np.uint8]
    """(H, W, 3) RGB as the sensor gave it, not undistorted."""
    host_stamp_s: float
    """This computer's clock, seconds since 1970, when the frame was complete."""
    camera_stamp_s: float | None
    """The camera's own clock, when it has one."""
    source: str
    """Which frame of which device or file."""


@runtime_checkable
class FollowsRobot(Protocol):
    """A camera that draws its pictures, and so must be shown the arm that is in them."""

    def follow(self, robot: Robot) -> None:
        """Draw this robot from now on."""
        ...


@runtime_checkable
class KnowsTruth(Protocol):
    """A camera that knows where it stands and which pixels show the robot."""

    def with_truth(self, recording: Recording) -> Recording:
        """The recording with masks and truth, saved in its folder."""
        ...


class Camera(Protocol):
    """A source of images."""

    name: str

    def grab(self, timeout_s: float = 2.0) -> Frame:
        """A frame exposed after the call; raises `DeviceFault` when none comes."""
        ...

    def intrinsics(self) -> CameraModel | None:
        """What the device knows of its own optics."""
        ...

    def close(self) -> None:
        """Let go of the device. May be called twice."""
        ...
