"""Motions of the simulated arm, as generators of one step per cycle."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike

from hecbench import se3
from hecbench.se3 import Array
from hecbench_hardware.controller_sim.arm import MAX_JOINT_SPEED_RAD_S, SimulatedArm, require_finite
from hecbench_hardware.controller_sim.geometry import angle_about, circle_centre

Motion = Generator[None, None, None]
"""Every `next` moves the arm by one cycle."""

_ROTATION_ARM_M = 0.2
"""How many metres of travel one radian of tool rotation counts in the speed profile of a straight motion."""
_RAMP_SHARE = 0.25
"""Share of a motion of given duration that each ramp of its speed takes."""


def _profile(
    arm: SimulatedArm, length: float, speed: float, acceleration: float, duration_s: float = 0.0
) -> Iterator[float]:
    """Fractions of a trapezoidal speed profile, one per cycle, the last one exactly 1.

    A duration above 0 takes the place of speed and acceleration.
    """
    if length < 1e-12:
        return
    if duration_s > 0:
        speed = length / (duration_s * (1 - _RAMP_SHARE))
        acceleration = speed / (duration_s * _RAMP_SHARE)
    speed, acceleration = max(speed, 1e-6), max(acceleration, 1e-6)
    ramp = min(speed / acceleration, sqrt(length / acceleration))
    top = acceleration * ramp
    duration = 2 * ramp + max(0.0, length - top * ramp) / top
    t = 0.0
    while t < duration:
        t = min(duration, t + arm.dt_s * arm.speed_slider * arm.slowdown)
        if t < ramp:
            travelled = 0.5 * acceleration * t * t
        elif t < duration - ramp:
            travelled = 0.5 * top * ramp + top * (t - ramp)
        else:
            travelled = length - 0.5 * acceleration * (duration - t) ** 2
        yield min(1.0, travelled / length)


def move_joints(
    arm: SimulatedArm, target: ArrayLike, speed: float, acceleration: float, duration_s: float = 0.0
) -> Motion:
    """Straight in joint space, rad/s and rad/s^2 of the leading joint."""
    arm.note("motion: joints")
    start, end = arm.joints.copy(), np.array(target, float)
    require_finite("movej", end, speed, acceleration, duration_s)
    if np.abs(end).max() > arm.arm.joint_range_rad:
        arm.protective_stop("target outside the joint range")
        return
    top = min(speed, MAX_JOINT_SPEED_RAD_S)
    for fraction in _profile(arm, float(np.abs(end - start).max()), top, acceleration, duration_s):
        arm.move(start + fraction * (end - start))
        yield
    arm.joint_speeds = np.zeros(6)


def move_linear(
    arm: SimulatedArm, base_T_target: Array, speed: float, acceleration: float, duration_s: float = 0.0
) -> Motion:
    """Straight in space, m/s and m/s^2, rotation at the same pace."""
    arm.note("motion: line")
    require_finite("movel", base_T_target, speed, acceleration, duration_s)
    start = arm.base_T_tcp
    turn = se3.so3_log(base_T_target[:3, :3] @ start[:3, :3].T)
    shift = base_T_target[:3, 3] - start[:3, 3]
    length = max(float(np.linalg.norm(shift)), _ROTATION_ARM_M * float(np.linalg.norm(turn)))
    for fraction in _profile(arm, length, speed, acceleration, duration_s):
        rotation = se3.so3_exp(fraction * turn) @ start[:3, :3]
        arm.move_to(se3.make(rotation, start[:3, 3] + fraction * shift))
        yield
    arm.joint_speeds = np.zeros(6)


def move_circular(
    arm: SimulatedArm, base_T_via: Array, base_T_target: Array, speed: float, acceleration: float
) -> Motion:
    """Along the circle from here through a point to a pose, m/s and m/s^2; rotation at the same pace."""
    arm.note("motion: arc")
    require_finite("movec", base_T_via, base_T_target, speed, acceleration)
    start = arm.base_T_tcp
    a, b, c = start[:3, 3], base_T_via[:3, 3], base_T_target[:3, 3]
    normal = np.cross(b - a, c - a)
    if np.linalg.norm(normal) < 1e-9:
        yield from move_linear(arm, base_T_target, speed, acceleration)
        return
    normal /= np.linalg.norm(normal)
    centre = circle_centre(a, b, c)
    angle = angle_about(normal, a - centre, c - centre)
    turn = se3.so3_log(base_T_target[:3, :3] @ start[:3, :3].T)
    length = angle * float(np.linalg.norm(a - centre))
    for fraction in _profile(arm, length, speed, acceleration):
        point = centre + se3.so3_exp(fraction * angle * normal) @ (a - centre)
        arm.move_to(se3.make(se3.so3_exp(fraction * turn) @ start[:3, :3], point))
        yield
    arm.joint_speeds = np.zeros(6)


def brake(arm: SimulatedArm, deceleration: float) -> Motion:
    """Slow every joint down at one pace until all stand, rad/s^2 of the fastest one."""
    speeds = arm.joint_speeds.copy()
    fastest = max(float(np.abs(speeds).max()), 1e-9)
    pace = 1.0
    while (pace := pace - max(deceleration, 1e-3) * arm.dt_s / fastest) > 0:
        arm.turn(speeds * pace)
        yield
    arm.joint_speeds = np.zeros(6)
