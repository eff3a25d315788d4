"""The simulated arm: its state, its clock, its safety, and motions as generators of one step per cycle."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike

from hecbench import se3
from hecbench.se3 import Array
from hecbench_hardware.controller_sim.signals import REGISTERS, RobotMode, SafetyMode
from hecbench_hardware.kinematics import UrArm

Motion = Generator[None, None, None]
"""A motion: every `next` moves the arm by one cycle."""

HOME_RAD = (0.0, -np.pi / 2, np.pi / 2, -np.pi / 2, -np.pi / 2, 0.0)
PROTECTIVE_STOP_LOCKOUT_S = 5.0
FORCE_LIMIT_N = 150.0
_CONTACT_STIFFNESS_N_M = 2e4
_MAX_JOINT_STEP_RAD = 0.5
_ROTATION_ARM_M = 0.2
"""How many metres of travel one radian of tool rotation counts in the speed profile of a straight motion."""


class ScriptError(Exception):
    """A run-time error of the program on the controller (a pose out of reach): the program dies."""


def pose_of(vector: Array) -> Array:
    """Transform (4, 4) of the maker's pose vector (6,): metres and rotation vector."""
    return se3.from_rotvec(vector[3:6], vector[:3])


def vector_of(a_T_b: Array) -> Array:
    """The maker's pose vector (6,) of a transform (4, 4)."""
    return np.concatenate([a_T_b[:3, 3], se3.so3_log(a_T_b[:3, :3])])


class SimulatedArm:
    """State of one arm between cycles. Times are the controller's own, which may run faster than the wall."""

    def __init__(self, arm: UrArm) -> None:
        self.arm = arm
        self.joints = np.array(HOME_RAD)
        self.joint_speeds = np.zeros(6)
        self.flange_T_tcp = np.eye(4)
        self.tcp_offset = np.zeros(6)
        self._seen: tuple[Array | None, Array | None] = (None, None)
        self._tcp_vector: list[float] = []
        self.wrench = np.zeros(6)
        self.time_s = 0.0
        self.dt_s = 0.002
        self.safety = SafetyMode.NORMAL
        self.robot_mode = RobotMode.RUNNING
        self.stopped_at_s = -np.inf
        self.speed_slider = 1.0
        self.slowdown = 1.0
        self.digital_outputs = 0
        self.payload_kg = 0.0
        self.payload_cog_m = [0.0, 0.0, 0.0]
        self.contact_plane_m: float | None = None
        self.external_force_n = 0.0
        self.nothing_reachable = False
        self.int_inputs, self.double_inputs = [0] * REGISTERS, [0.0] * REGISTERS
        self.int_outputs, self.double_outputs = [0] * REGISTERS, [0.0] * REGISTERS
        self.log: list[str] = []

    def note(self, text: str) -> None:
        """Remember an event with the controller's time."""
        self.log.append(f"{self.time_s:.3f} {text}")

    def protective_stop(self, why: str) -> None:
        """Stop as the real one does when it meets resistance or a forbidden target."""
        if self.safety is SafetyMode.NORMAL:
            self.safety, self.stopped_at_s = SafetyMode.PROTECTIVE_STOP, self.time_s
            self.joint_speeds[:] = 0
            self.note(f"protective stop: {why}")

    def unlock(self) -> bool:
        """Leave the protective stop; refused during the first five seconds, as on the real one."""
        if self.safety is SafetyMode.PROTECTIVE_STOP:
            if self.time_s - self.stopped_at_s < PROTECTIVE_STOP_LOCKOUT_S:
                return False
            self.safety = SafetyMode.NORMAL
        return True

    def emergency_stop(self) -> None:
        """The red button: power goes off too."""
        self.safety, self.robot_mode = SafetyMode.ROBOT_EMERGENCY_STOP, RobotMode.POWER_OFF
        self.joint_speeds[:] = 0
        self.note("emergency stop")

    def release_emergency_stop(self) -> None:
        """The button is pulled out; power stays off until asked for."""
        if self.safety is SafetyMode.ROBOT_EMERGENCY_STOP:
            self.safety = SafetyMode.NORMAL

    @property
    def base_T_tcp(self) -> Array:
        """Pose of the tool centre point (4, 4)."""
        return np.asarray(self.arm.forward(self.joints) @ self.flange_T_tcp)

    @property
    def tcp_vector(self) -> list[float]:
        """The same as the maker's pose vector; computed again only after a change, for it is asked each cycle."""
        if self._seen[0] is not self.joints or self._seen[1] is not self.flange_T_tcp:
            self._seen, self._tcp_vector = (
                (self.joints, self.flange_T_tcp),
                vector_of(self.base_T_tcp).tolist(),
            )
        return self._tcp_vector

    def solve(self, base_T_tcp: Array, near_rad: ArrayLike) -> Array:
        """The joints (6,) nearest to `near_rad`; raises `ScriptError` when there are none."""
        solutions = self.arm.inverse(base_T_tcp @ se3.inverse(self.flange_T_tcp), near_rad)
        if self.nothing_reachable or not len(solutions):
            raise ScriptError("getInverseKin: unable to find an inverse kinematics solution")
        return np.asarray(solutions[0])

    def update_contact(self) -> None:
        """Set the tool force from the contact plane, and stop above the force limit."""
        depth = 0.0 if self.contact_plane_m is None else self.contact_plane_m - self.base_T_tcp[2, 3]
        self.wrench[2] = self.external_force_n + max(0.0, depth) * _CONTACT_STIFFNESS_N_M
        if self.wrench[2] > FORCE_LIMIT_N:
            self.protective_stop(f"force {self.wrench[2]:.0f} N above {FORCE_LIMIT_N:.0f} N")

    def _move(self, joints: Array) -> None:
        self.joint_speeds = (joints - self.joints) / self.dt_s
        self.joints = joints

    def _profile(self, length: float, speed: float, acceleration: float) -> Iterator[float]:
        """Fractions of a trapezoidal speed profile, one per cycle, the last one exactly 1."""
        if length < 1e-12:
            return
        speed, acceleration = max(speed, 1e-6), max(acceleration, 1e-6)
        ramp = min(speed / acceleration, sqrt(length / acceleration))
        top = acceleration * ramp
        duration = 2 * ramp + max(0.0, length - top * ramp) / top
        t = 0.0
        while t < duration:
            t = min(duration, t + self.dt_s * self.speed_slider * self.slowdown)
            if t < ramp:
                travelled = 0.5 * acceleration * t * t
            elif t < duration - ramp:
                travelled = 0.5 * top * ramp + top * (t - ramp)
            else:
                travelled = length - 0.5 * acceleration * (duration - t) ** 2
            yield min(1.0, travelled / length)

    def move_joints(self, target: ArrayLike, speed: float, acceleration: float) -> Motion:
        """Straight in joint space, rad/s and rad/s^2 of the leading joint."""
        self.note("motion: joints")
        start, end = self.joints.copy(), np.array(target, float)
        if np.abs(end).max() > self.arm.joint_range_rad:
            self.protective_stop("target outside the joint range")
            return
        for fraction in self._profile(float(np.abs(end - start).max()), speed, acceleration):
            self._move(start + fraction * (end - start))
            yield
        self.joint_speeds = np.zeros(6)

    def move_linear(self, base_T_target: Array, speed: float, acceleration: float) -> Motion:
        """Straight in space, m/s and m/s^2, rotation at the same pace."""
        self.note("motion: line")
        start = self.base_T_tcp
        turn = se3.so3_log(base_T_target[:3, :3] @ start[:3, :3].T)
        shift = base_T_target[:3, 3] - start[:3, 3]
        length = max(float(np.linalg.norm(shift)), _ROTATION_ARM_M * float(np.linalg.norm(turn)))
        for fraction in self._profile(length, speed, acceleration):
            rotation = se3.so3_exp(fraction * turn) @ start[:3, :3]
            self._move_to(se3.make(rotation, start[:3, 3] + fraction * shift))
            yield
        self.joint_speeds = np.zeros(6)

    def _move_to(self, base_T_tcp: Array) -> None:
        joints = self.solve(base_T_tcp, self.joints)
        if np.abs(joints - self.joints).max() > _MAX_JOINT_STEP_RAD:
            raise ScriptError("the linear path meets a singularity")
        self._move(joints)

    def drift(self, tool_twist: Array) -> None:
        """One cycle of a constant tool velocity [v m/s, w rad/s] (6,) in the base frame."""
        pose = self.base_T_tcp
        rotation = se3.so3_exp(tool_twist[3:] * self.dt_s) @ pose[:3, :3]
        self._move_to(se3.make(rotation, pose[:3, 3] + tool_twist[:3] * self.dt_s))

    def turn(self, joint_speeds: Array) -> None:
        """One cycle of a constant joint velocity (6,) rad/s."""
        self._move(self.joints + joint_speeds * self.dt_s)

    def follow(self, target: Array, top_speed: float) -> None:
        """One cycle towards joints (6,) no faster than `top_speed` rad/s."""
        limit = top_speed * self.dt_s
        self._move(self.joints + np.clip(target - self.joints, -limit, limit))

    def brake(self, deceleration: float) -> Motion:
        """Slow every joint down at one pace until all stand, rad/s^2 of the fastest one."""
        speeds = self.joint_speeds.copy()
        fastest = max(float(np.abs(speeds).max()), 1e-9)
        pace = 1.0
        while (pace := pace - max(deceleration, 1e-3) * self.dt_s / fastest) > 0:
            self.turn(speeds * pace)
            yield
        self.joint_speeds = np.zeros(6)
