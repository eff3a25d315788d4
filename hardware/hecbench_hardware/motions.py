"""The motions that an arm makes, as its controller makes them: joints at every fraction of the way.

A joint motion is straight in joint space. A straight line is one of the tool centre point, which the controller moves
evenly while it turns the tool about one axis; with a tool offset the flange then follows an arc. No motion is blended
into the next: each begins where the last one ended.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from hecbench import se3
from hecbench.errors import InputError
from hecbench.se3 import Array
from hecbench_hardware.kinematics import Arm

_TURN_STEP_RAD = 0.2
"""Sum of the joint steps between the first samples of a joint motion; the check puts more where they are needed."""
_LINE_STEP_M, _LINE_TURN_RAD = 0.01, 0.05
_TURN_ARM_M = 0.2
"""Metres of travel that a radian of turn counts for in the pace of a line: the simulated controller's rule. The maker
does not publish his; a lower speed is slower there too."""
_NO_LENGTH_M = 1e-6
_JUMP_RAD = 0.5
"""A joint step between two samples of a straight line above which it is a singularity."""


class Motion(Protocol):
    """One motion, sampled."""

    @property
    def fractions(self) -> Array:
        """(N,) of the way, 0 to 1, evenly spaced."""
        ...

    @property
    def joints(self) -> Array:
        """(N, 6) rad there."""
        ...

    def at(self, fraction: float, near_rad: Array) -> Array:
        """Joints (6,) rad at a fraction of the way, near others (6,) on it."""
        ...

    def travel(self, fractions: Array, joints: Array, tool_m: Array) -> tuple[Array, Array]:
        """The furthest way that points cover between successive samples.

        Args:
            fractions, joints: (N,), (N, 6) rad, samples of this motion.
            tool_m: (S, 3) points in the flange frame.

        Returns:
            (N - 1, S) m of these points, and (N - 1,) m of any point of the arm.
        """
        ...


def six_joints(joints_rad: ArrayLike) -> Array:
    """The joints as floats (6,); refuses another length and values that are not finite."""
    joints = np.asarray(joints_rad, float)
    if joints.shape != (6,):
        raise InputError(f"the target has shape {joints.shape}; give six joint angles in radians")
    if not np.isfinite(joints).all():
        raise InputError(f"the target {joints.tolist()} is not finite; give six joint angles in radians")
    return joints


def reaches_m(arm: Arm) -> Array:
    """(6,) m, how far the flange is at most from the axis of each joint: the sum of the links behind it."""
    origins = arm.link_frames(np.zeros(6))[:, :3, 3]
    links = np.linalg.norm(np.diff(origins, axis=0), axis=1)
    behind = np.cumsum(links[::-1])[::-1]
    return np.concatenate([behind[:1], behind])


@dataclass(frozen=True, eq=False)
class JointMotion:
    """Straight in joint space from `start` to `end` (6,) rad."""

    arm: Arm
    start: Array
    end: Array

    @property
    def fractions(self) -> Array:
        """(N,)."""
        steps = int(np.ceil(np.abs(self.end - self.start).sum() / _TURN_STEP_RAD))
        return np.linspace(0, 1, max(steps, 1) + 1)

    @property
    def joints(self) -> Array:
        """(N, 6) rad."""
        return np.asarray(self.start + self.fractions[:, None] * (self.end - self.start))

    def at(self, fraction: float, near_rad: Array) -> Array:
        """Joints (6,) rad."""
        return np.asarray(self.start + fraction * (self.end - self.start))

    def travel(self, fractions: Array, joints: Array, tool_m: Array) -> tuple[Array, Array]:
        """Each joint turns every point behind it about its axis, at most at the flange's reach and the point's."""
        turns = np.abs(np.diff(joints, axis=0))
        body = turns @ reaches_m(self.arm)
        return body[:, None] + turns.sum(1)[:, None] * np.linalg.norm(tool_m, axis=1), body


@dataclass(frozen=True, eq=False)
class LineMotion:
    """The tool centre point straight, from joints `start` (6,) rad to where the flange is at `base_T_target` (4, 4)."""

    arm: Arm
    start: Array
    base_T_target: Array
    flange_T_tcp: Array = field(default_factory=lambda: np.eye(4))

    def __post_init__(self) -> None:
        """Refuse what is not a pose."""
        if not se3.is_transform(self.base_T_target):
            raise InputError(
                "the target is not a rigid transform (4, 4) with finite values; give base_T_flange"
            )

    @cached_property
    def _first(self) -> Array:
        """base_T_tcp (4, 4) at the start."""
        return np.asarray(self.arm.forward(self.start) @ self.flange_T_tcp)

    @cached_property
    def base_T_tcp(self) -> Array:
        """Pose (4, 4) of the tool centre point at the end."""
        return np.asarray(self.base_T_target @ self.flange_T_tcp)

    @cached_property
    def shift_m(self) -> Array:
        """(3,) m, of the tool centre point in the base frame."""
        return np.asarray(self.base_T_tcp[:3, 3] - self._first[:3, 3])

    @cached_property
    def turn_rad(self) -> Array:
        """(3,) rotation vector of the tool in the base frame."""
        return np.asarray(se3.so3_log(self.base_T_tcp[:3, :3] @ self._first[:3, :3].T))

    @cached_property
    def fractions(self) -> Array:
        """(N,)."""
        shift, turn = float(np.linalg.norm(self.shift_m)), float(np.linalg.norm(self.turn_rad))
        steps = int(np.ceil(max(shift / _LINE_STEP_M, turn / _LINE_TURN_RAD)))
        return np.linspace(0, 1, max(steps, 1) + 1)

    @cached_property
    def joints(self) -> Array:
        """(N, 6) rad."""
        path = [self.start]
        for fraction in self.fractions[1:]:
            path.append(self.at(fraction, path[-1]))
        return np.array(path)

    def at(self, fraction: float, near_rad: Array) -> Array:
        """Joints (6,) rad; raises `InputError` for a pose out of reach, or beyond a singularity."""
        rotation = se3.so3_exp(fraction * self.turn_rad) @ self._first[:3, :3]
        base_T_tcp = se3.make(rotation, self._first[:3, 3] + fraction * self.shift_m)
        solutions = self.arm.inverse(base_T_tcp @ se3.inverse(self.flange_T_tcp), near_rad)
        if not len(solutions):
            raise InputError(
                f"at {fraction:.0%} of the line the pose is out of reach: choose a nearer target"
            )
        if np.abs(solutions[0] - near_rad).max() > _JUMP_RAD:
            raise InputError(f"at {fraction:.0%} of the line the arm meets a singularity: use a joint motion")
        return np.asarray(solutions[0])

    def travel(self, fractions: Array, joints: Array, tool_m: Array) -> tuple[Array, Array]:
        """Tool: the shift, and the turn at the distance from the tool centre point. Arm: the turns of its joints.

        A joint may be faster between two samples than on average, or turn back; by how much is taken from the change of
        its rate to the samples beside them.
        """
        lever_m = np.linalg.norm(tool_m - self.flange_T_tcp[:3, 3], axis=1)
        way_m = np.linalg.norm(self.shift_m) + np.linalg.norm(self.turn_rad) * lever_m
        steps = np.diff(fractions)[:, None]
        rates = np.diff(joints, axis=0) / steps
        bends = np.abs(np.diff(rates, axis=0, prepend=rates[:1], append=rates[-1:]))
        turns = steps * (np.abs(rates) + np.maximum(bends[:-1], bends[1:]))
        return steps * way_m, turns @ reaches_m(self.arm)

    @property
    def length_m(self) -> float:
        """What the tool speed counts along: the shift, or the turn where that takes longer."""
        turned_m = _TURN_ARM_M * float(np.linalg.norm(self.turn_rad))
        return max(float(np.linalg.norm(self.shift_m)), turned_m)

    def speed_m_s(self, joint_speed_rad_s: float) -> float:
        """The tool speed at which no joint is faster than allowed; infinite where nothing moves."""
        if self.length_m < _NO_LENGTH_M:
            return float("inf")
        step_rad = float(np.abs(np.diff(self.joints, axis=0)).max())
        return joint_speed_rad_s * self.length_m / (len(self.joints) - 1) / step_rad


def motion_time_s(length: float, speed: float, acceleration: float) -> float:
    """Duration of a trapezoidal speed profile over a length, in any one unit."""
    ramp = min(speed / acceleration, np.sqrt(length / acceleration))
    return float(2 * ramp + max(0.0, length - acceleration * ramp**2) / speed)
