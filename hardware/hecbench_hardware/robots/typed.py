"""A robot without a link to this computer: a person types or pastes where it stands."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from hecbench.errors import InputError
from hecbench.exchange.pose_numbers import ROTATIONS, VENDORS, pose_conventions
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import DeviceSpec, Kind
from hecbench_hardware.devices import RobotState
from hecbench_hardware.kinematics import ARMS, Arm
from hecbench_hardware.limits import Limits, Sphere
from hecbench_hardware.motions import six_joints

JOINTS = "joints"
CONVENTIONS = (*VENDORS, *(name for names in ROTATIONS.values() for name in names), JOINTS)
"""How a typed pose may be written; "joints" are six angles."""


class TypedRobot:
    """Follows the `Robot` protocol for reading; nothing can be moved.

    Attributes:
        kinematics: of the arm, when its model is known: joints can be typed then.
    """

    name = "typed"
    simulated = False
    enabled = False

    def __init__(self, kinematics: Arm | None = None) -> None:
        """No pose is known yet."""
        self.kinematics = kinematics
        self.limits = Limits()
        self._joints_rad = np.full(6, np.nan)
        self._base_T_flange: Array | None = None
        self._typed_s = 0.0

    @property
    def arm(self) -> Arm:
        """Its kinematics; an `InputError` when the model is not known."""
        if self.kinematics is None:
            raise InputError(f"the typed robot's model is not known: --set robot.arm={'|'.join(ARMS)}")
        return self.kinematics

    def type(self, text: str, convention: str, unit: str = "m", degrees: bool = False) -> None:
        """Take the pose of the flange from what a person copied.

        Args:
            text: x y z and the rotation, a 3x4 or 4x4 matrix, or six joints; commas, brackets, line ends are skipped.
            convention: one of `CONVENTIONS`.
            unit: of lengths: m, cm or mm.
            degrees: of angles.

        Raises:
            InputError: it is not understood.
        """
        numbers = _numbers(text)
        turn = np.deg2rad(numbers) if degrees else numbers
        if convention == JOINTS:
            joints_rad = six_joints(turn)
            self._base_T_flange = self.arm.forward(joints_rad)
            self._joints_rad = joints_rad
        else:
            if degrees and len(numbers) == 6:
                numbers = np.concatenate([numbers[:3], turn[3:]])
            found = pose_conventions(
                numbers[None], ("base", "flange"), rotation=convention, unit=unit, inverted=False
            )
            self._base_T_flange = found[0].poses[0]
            self._joints_rad = np.full(6, np.nan)
        self._typed_s = time.time()

    def state(self) -> RobotState:
        """As it was typed."""
        if self._base_T_flange is None:
            raise InputError("the robot's pose is not known: type or paste it")
        return RobotState(
            joints_rad=self._joints_rad.copy(),
            joint_speeds_rad_s=np.zeros(6),
            base_T_flange=self._base_T_flange,
            nominal_base_T_flange=self._base_T_flange,
            base_T_tcp=self._base_T_flange,
            wrench=np.zeros(6),
            robot_stamp_s=self._typed_s,
            host_stamp_s=self._typed_s,
            speed_fraction=1.0,
        )

    def settle(self, timeout_s: float = 5.0) -> RobotState:
        """The person says that it stands."""
        return self.state()

    def enable(self) -> None:
        """There is nothing to take control of."""
        raise InputError(self._still)

    def move_joints(self, joints_rad: Array, *, speed_rad_s: float | None = None) -> None:
        """Refused."""
        raise InputError(self._still)

    def move_linear(self, base_T_flange: Array, *, speed_m_s: float | None = None) -> None:
        """Refused."""
        raise InputError(self._still)

    @property
    def _still(self) -> str:
        return "the typed robot has no link and cannot be moved from here: move it at its pendant"

    def carry(self, balls: tuple[Sphere, ...]) -> None:
        """Nothing is moved, so nothing is checked."""

    def stop(self) -> None:
        """Nothing is moved."""

    @contextmanager
    def freedrive(self) -> Iterator[None]:
        """The person moves it as they like."""
        yield

    def recover(self, acknowledge: Callable[[str], bool]) -> bool:
        """There is no fault to recover from."""
        return True

    def describe(self) -> dict[str, Any]:
        """The arm's name, when it is known."""
        return {"model": self.kinematics and self.kinematics.name, "simulated": False, "typed": True}

    def close(self) -> None:
        """Nothing to let go of."""


def _numbers(text: str) -> Array:
    bare = text.strip().removeprefix("p") if text.strip().startswith("p[") else text  # URScript writes p[...]
    words = "".join(" " if sign in ",;[](){}\n\t" else sign for sign in bare).split()
    try:
        numbers = np.array([float(word) for word in words])
    except ValueError:
        raise InputError(f"the pose '{text}' holds more than numbers: give x y z and the rotation") from None
    if not len(numbers) or not np.isfinite(numbers).all():
        raise InputError(f"the pose '{text}' holds no finite numbers: give x y z and the rotation")
    return numbers


def open_typed(options: Mapping[str, str]) -> TypedRobot:
    """A robot that waits for its first pose."""
    name = options.get("arm")
    if name is not None and name not in ARMS:
        raise InputError(f"robot.arm={name}: choose one of {', '.join(ARMS)}, or leave it out")
    return TypedRobot(ARMS[name] if name else None)


@hookimpl
def hecbench_robots() -> Iterable[DeviceSpec]:
    """The robot without a link."""
    yield DeviceSpec(
        name="typed",
        kind=Kind.ROBOT,
        summary="no link: a person types or pastes the poses into the cockpit",
        imports=(),
        open=open_typed,
        simulated=False,
        options=("arm",),
    )
