"""Poses and rotations."""

from __future__ import annotations

from typing import Final

import numpy as np

from hecbench import se3
from hecbench.se3 import Array
from hecbench_hardware.controller_sim.urscript.functions import builtins
from hecbench_hardware.controller_sim.urscript.machine import Machine
from hecbench_hardware.controller_sim.urscript.values import Pose, Value, number, pose, vector


def pose_trans(_: Machine, p_from: Value, p_from_to: Value) -> Pose:
    """The second pose, given in the first."""
    return Pose.of(pose(p_from, "p_from") @ pose(p_from_to, "p_from_to"))


def pose_inv(_: Machine, p_from: Value) -> Pose:
    """The inverse."""
    return Pose.of(se3.inverse(pose(p_from, "p_from")))


def pose_add(_: Machine, p_1: Value, p_2: Value) -> Pose:
    """Positions added, rotations multiplied."""
    a, b = pose(p_1, "p_1"), pose(p_2, "p_2")
    return Pose.of(se3.make(a[:3, :3] @ b[:3, :3], a[:3, 3] + b[:3, 3]))


def pose_sub(_: Machine, p_to: Value, p_from: Value) -> Pose:
    """Positions subtracted, the rotation from the second to the first."""
    a, b = pose(p_to, "p_to"), pose(p_from, "p_from")
    return Pose.of(se3.make(a[:3, :3] @ b[:3, :3].T, a[:3, 3] - b[:3, 3]))


def pose_dist(_: Machine, pose_from: Value, pose_to: Value) -> float:
    """Length of the difference of the six numbers' position and rotation vector."""
    return float(np.linalg.norm(pose_sub(_, pose_to, pose_from)))


def point_dist(_: Machine, p_from: Value, p_to: Value) -> float:
    """Distance of two positions."""
    return float(np.linalg.norm(pose(p_from, "p_from")[:3, 3] - pose(p_to, "p_to")[:3, 3]))


def interpolate_pose(_: Machine, p_from: Value, p_to: Value, alpha: Value) -> Pose:
    """The pose at a fraction of the straight way."""
    a, b, part = pose(p_from, "p_from"), pose(p_to, "p_to"), number(alpha, "alpha")
    turn = se3.so3_exp(part * se3.so3_log(b[:3, :3] @ a[:3, :3].T))
    return Pose.of(se3.make(turn @ a[:3, :3], a[:3, 3] + part * (b[:3, 3] - a[:3, 3])))


def wrench_trans(_: Machine, T_from_to: Value, w_from: Value) -> list[float]:
    """A wrench, force before torque, in another frame."""
    frame, wrench = pose(T_from_to, "T_from_to"), vector(w_from, 6, "w_from")
    rotation, shift = frame[:3, :3], frame[:3, 3]
    force = rotation.T @ wrench[:3]
    torque = rotation.T @ (wrench[3:] - np.cross(shift, wrench[:3]))
    return [float(x) for x in (*force, *torque)]


def rpy2rotvec(_: Machine, rpy_vector: Value) -> list[float]:
    """Rotation vector of roll, pitch and yaw about the fixed axes x, y, z."""
    roll, pitch, yaw = vector(rpy_vector, 3, "rpy_vector")
    x, y, z = np.eye(3)
    rotvec: list[float] = se3.so3_log(_turn(z, yaw) @ _turn(y, pitch) @ _turn(x, roll)).tolist()
    return rotvec


def rotvec2rpy(_: Machine, rotation_vector: Value) -> list[float]:
    """Roll, pitch and yaw of a rotation vector; roll is 0 where they are not unique."""
    r = se3.so3_exp(vector(rotation_vector, 3, "rotation_vector"))
    flat = float(np.hypot(r[0, 0], r[1, 0]))
    pitch = np.arctan2(-r[2, 0], flat)
    if flat < 1e-9:
        return [0.0, float(pitch), float(np.arctan2(-r[0, 1], r[1, 1]))]
    return [float(np.arctan2(r[2, 1], r[2, 2])), float(pitch), float(np.arctan2(r[1, 0], r[0, 0]))]


def inv(_: Machine, m: Value) -> Value:
    """The inverse of a pose or of a matrix."""
    if isinstance(m, Pose):
        return pose_inv(_, m)
    inverse: list[list[float]] = np.linalg.inv(np.array(m, float)).tolist()
    return inverse


def _turn(axis: Array, angle: float) -> Array:
    return np.asarray(se3.so3_exp(axis * angle))


FUNCTIONS: Final = builtins(
    pose_trans,
    pose_inv,
    pose_add,
    pose_sub,
    pose_dist,
    point_dist,
    interpolate_pose,
    wrench_trans,
    rpy2rotvec,
    rotvec2rpy,
    inv,
)
