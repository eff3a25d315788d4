"""What the arm may do: joints, speeds, a workspace and forbidden boxes. clearance.py checks motions against it.

This does not replace the controller's own safety settings.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import numpy as np

from hecbench.errors import InputError
from hecbench.system import files

Vector = tuple[float, float, float]
Joints = tuple[float, float, float, float, float, float]

HIGHEST = {
    "joint_speed_rad_s": 1.0,
    "joint_acceleration_rad_s2": 4.0,
    "tool_speed_m_s": 0.5,
    "tool_acceleration_m_s2": 2.0,
}
"""What no file of limits can exceed. The speeds are twice the defaults, 0.25 m/s of which ISO 10218-1 allows beside a
person; from 1 rad/s the driver's braking (4 rad/s^2) takes a quarter of a second."""


@dataclass(frozen=True)
class Box:
    """An axis-aligned box in the base frame, metres."""

    lower_m: Vector
    upper_m: Vector


@dataclass(frozen=True)
class Sphere:
    """Part of the tool: a ball at a point of the flange frame, metres."""

    centre_m: Vector
    radius_m: float


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Bounds of every motion. The defaults are slow and keep the tool above the plane of the robot's foot."""

    joint_lower_rad: Joints = (-2 * np.pi,) * 6
    joint_upper_rad: Joints = (2 * np.pi,) * 6
    joint_speed_rad_s: float = 0.5
    joint_acceleration_rad_s2: float = 1.0
    tool_speed_m_s: float = 0.25
    tool_acceleration_m_s2: float = 0.5
    workspace: Box = Box((-1.5, -1.5, 0.0), (1.5, 1.5, 2.0))
    """The whole tool stays inside."""
    keep_out: tuple[Box, ...] = ()
    """Neither tool nor arm may touch these."""
    tool: tuple[Sphere, ...] = field(default=(Sphere((0.0, 0.0, 0.0), 0.06), Sphere((0.0, 0.0, 0.1), 0.06)))
    arm_radius_m: float = 0.07

    def __post_init__(self) -> None:
        """Refuse bounds that allow nothing or make no sense."""
        for name in (
            "joint_speed_rad_s", "joint_acceleration_rad_s2", "tool_speed_m_s", "tool_acceleration_m_s2"
        ):  # fmt: skip
            if not 0 < getattr(self, name) < np.inf:
                raise InputError(f"limits: {name} must be positive, not {getattr(self, name)}")
        if not (np.array(self.joint_lower_rad) < self.joint_upper_rad).all():
            raise InputError("limits: every joint_lower_rad must lie below its joint_upper_rad")
        if not min([self.arm_radius_m, *(ball.radius_m for ball in self.tool)]) >= 0:
            raise InputError("limits: arm_radius_m and the radii of the tool must not be negative")
        for box in (self.workspace, *self.keep_out):
            if not (np.array(box.lower_m) < box.upper_m).all():
                raise InputError(
                    f"limits: box {box.lower_m} to {box.upper_m} is empty; lower must be below upper"
                )


def refuse_too_fast(limits: Limits) -> None:
    """Raise an `InputError` for speeds and accelerations that no real arm is driven at."""
    for name, highest in HIGHEST.items():
        if getattr(limits, name) > highest:
            raise InputError(f"limits: {name} {getattr(limits, name)} is above the most allowed, {highest}")


def load_limits(path: Path) -> Limits:
    """Limits from a JSON file; absent keys keep their defaults, unknown ones and speeds above `HIGHEST` are refused."""
    try:
        raw = msgspec.json.decode(files.read_bytes(path))
        unknown = set(raw) - set(Limits.__dataclass_fields__) if isinstance(raw, dict) else set()
        if unknown:
            raise InputError(f"{path}: unknown limit '{sorted(unknown)[0]}'; see docs/hardware-safety.md")
        limits = msgspec.convert(raw, Limits)
        refuse_too_fast(limits)
    except msgspec.MsgspecError as error:
        raise InputError(f"{path}: {error}; see docs/hardware-safety.md") from error
    return limits
