"""What the arm may do: joints, speeds, a workspace and forbidden boxes, checked along the whole path.

The tool (gripper, camera) is a set of spheres on the flange, the arm another along its links, so that
distances to boxes are exact. A path is sampled so densely that nothing moves further than a known margin
between samples, and half that margin is added to every sphere. This does not replace the controller's own
safety settings.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from hecbench import files, se3
from hecbench.errors import InputError
from hecbench.se3 import Array
from hecbench_hardware.kinematics import UrArm

Vector = tuple[float, float, float]
Joints = tuple[float, float, float, float, float, float]

_TURN_STEP_RAD = 0.02
"""Sum of the joint steps between two samples of a path."""
_LINE_STEP_M = 0.01
_LINE_TURN_RAD = 0.05
_JUMP_RAD = 0.5
"""A joint step between two samples of a straight line above which it is a singularity."""
_LINK_SAMPLES = np.linspace(0, 1, 6)


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
        for box in (self.workspace, *self.keep_out):
            if not (np.array(box.lower_m) < box.upper_m).all():
                raise InputError(
                    f"limits: box {box.lower_m} to {box.upper_m} is empty; lower must be below upper"
                )


def load_limits(path: Path) -> Limits:
    """Limits from a JSON file; absent keys keep their defaults, unknown ones are refused."""
    try:
        raw = msgspec.json.decode(files.read_bytes(path))
        unknown = set(raw) - set(Limits.__dataclass_fields__) if isinstance(raw, dict) else set()
        if unknown:
            raise InputError(f"{path}: unknown limit '{sorted(unknown)[0]}'; see docs/hardware-safety.md")
        return msgspec.convert(raw, Limits)
    except msgspec.MsgspecError as error:
        raise InputError(f"{path}: {error}; see docs/hardware-safety.md") from error


def six_joints(joints_rad: ArrayLike) -> Array:
    """The joints as floats (6,); refuses another length and values that are not finite."""
    joints = np.asarray(joints_rad, float)
    if joints.shape != (6,):
        raise InputError(f"the target has shape {joints.shape}; give six joint angles in radians")
    if not np.isfinite(joints).all():
        raise InputError(f"the target {joints.tolist()} is not finite; give six joint angles in radians")
    return joints


def joint_path(start: Array, end: Array) -> Array:
    """Samples (N, 6) rad of the straight line in joint space, both ends included."""
    count = int(np.ceil(np.abs(end - start).sum() / _TURN_STEP_RAD)) + 1
    return np.asarray(start + np.linspace(0, 1, max(count, 2))[:, None] * (end - start))


def linear_path(arm: UrArm, start: Array, base_T_target: Array) -> Array:
    """Joints (N, 6) rad along the straight line in space from joints (6,) to a flange pose (4, 4).

    Raises:
        InputError: A pose that is not a rigid transform, out of reach, or beyond a singularity.
    """
    if not se3.is_transform(base_T_target):
        raise InputError("the target is not a rigid transform (4, 4) with finite values; give base_T_flange")
    base_T_start = arm.forward(start)
    turn = se3.so3_log(base_T_target[:3, :3] @ base_T_start[:3, :3].T)
    shift = base_T_target[:3, 3] - base_T_start[:3, 3]
    steps = max(
        float(np.linalg.norm(shift)) / _LINE_STEP_M, float(np.linalg.norm(turn)) / _LINE_TURN_RAD, 1.0
    )
    path = [start]
    for fraction in np.linspace(0, 1, int(np.ceil(steps)) + 1)[1:]:
        rotation = se3.so3_exp(fraction * turn) @ base_T_start[:3, :3]
        solutions = arm.inverse(se3.make(rotation, base_T_start[:3, 3] + fraction * shift), path[-1])
        if not len(solutions):
            raise InputError(
                f"at {fraction:.0%} of the line the pose is out of reach: choose a nearer target"
            )
        if np.abs(solutions[0] - path[-1]).max() > _JUMP_RAD:
            raise InputError(f"at {fraction:.0%} of the line the arm meets a singularity: use a joint motion")
        path.append(solutions[0])
    return np.array(path)


def line_speed_m_s(path: Array, length_m: float, joint_speed_rad_s: float) -> float:
    """The tool speed at which no joint on an evenly sampled line (N, 6) rad is faster than allowed.

    Infinite for a turn on the spot, whose pace the controller chooses.
    """
    step_rad = float(np.abs(np.diff(path, axis=0)).max())
    step_m = length_m / (len(path) - 1)
    return joint_speed_rad_s * step_m / step_rad if step_m > 1e-6 and step_rad > 0 else float("inf")


def check_path(arm: UrArm, path: Array, limits: Limits) -> None:
    """Refuse joints (N, 6) rad whose joints, tool or links leave the limits anywhere on the way.

    Raises:
        InputError: Which bound, where on the path, by how much, and the cure.
    """
    _check_joints(path, limits)
    frames = arm.link_frames(path)
    margin = _path_margin(arm, path)
    tool = se3.transform_points(frames[:, 5], np.array([ball.centre_m for ball in limits.tool]))
    tool_radii = np.array([ball.radius_m for ball in limits.tool]) + margin
    lower, upper = np.array(limits.workspace.lower_m), np.array(limits.workspace.upper_m)
    excess = np.maximum(lower - (tool - tool_radii[:, None]), tool + tool_radii[:, None] - upper)
    _refuse(excess.max(axis=(1, 2)), "the tool leaves the workspace")
    body = link_points(frames)
    for box in limits.keep_out:
        what = f"keep-out box {box.lower_m} to {box.upper_m}"
        _refuse((tool_radii - _distance(tool, box)).max(axis=1), f"the tool enters the {what}")
        _refuse(
            (limits.arm_radius_m + margin - _distance(body, box)).max(axis=1), f"the arm enters the {what}"
        )


def _check_joints(path: Array, limits: Limits) -> None:
    lower, upper = np.array(limits.joint_lower_rad), np.array(limits.joint_upper_rad)
    for row, j in np.argwhere((path < lower) | (path > upper)).tolist():
        raise InputError(
            f"joint {j + 1} at {path[row, j]:.3f} rad is outside {lower[j]:.3f} to {upper[j]:.3f} rad:"
            " choose another target, or widen the limits"
        )


def _refuse(excess_m: Array, what: str) -> None:
    if excess_m.max() > 0:
        first = int(np.argmax(excess_m > 0))
        where = f"{first / max(len(excess_m) - 1, 1):.0%} of the way"
        raise InputError(f"{what} at {where}, by up to {excess_m.max():.3f} m: choose another target")


def _path_margin(arm: UrArm, path: Array) -> float:
    """Half of the furthest that a point of the arm or tool can move between two samples, metres."""
    if len(path) < 2:
        return 0.0
    return float(0.5 * arm.reach_m * np.abs(np.diff(path, axis=0)).sum(axis=1).max())


def _distance(points: Array, box: Box) -> Array:
    """Distances (...,) m of points (..., 3) from a box, 0 inside."""
    outside = np.maximum(np.maximum(np.array(box.lower_m) - points, points - np.array(box.upper_m)), 0)
    return np.asarray(np.linalg.norm(outside, axis=-1))


def link_points(frames: Array) -> Array:
    """Points (N, P, 3) m along the links for link frames (N, 6, 4, 4): upper arm, forearm, wrist.

    The upper arm runs beside the shoulder's axis, by about the offset of the wrist, as on the real arms.
    """
    origins = frames[..., :3, 3]
    wrist_offset = origins[:, 3] - origins[:, 2]
    upper = _between(origins[:, 0] + wrist_offset, origins[:, 1] + wrist_offset)
    return np.concatenate([upper, _between(origins[:, 1], origins[:, 2]), origins[:, 3:]], axis=1)


def _between(start: Array, end: Array) -> Array:
    return np.asarray(start[:, None] + _LINK_SAMPLES[:, None] * (end - start)[:, None])


def motion_time_s(length: float, speed: float, acceleration: float) -> float:
    """Duration of a trapezoidal speed profile over a length, in any one unit."""
    ramp = min(speed / acceleration, np.sqrt(length / acceleration))
    return float(2 * ramp + max(0.0, length - acceleration * ramp**2) / speed)
