"""The simulated arm: its state, its clock, its safety."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import ArrayLike

from hecbench import se3
from hecbench.se3 import Array
from hecbench_hardware.controller_sim.dynamics import Dynamics
from hecbench_hardware.controller_sim.geometry import pose_of, vector_of
from hecbench_hardware.controller_sim.inputs_outputs import InputsOutputs
from hecbench_hardware.controller_sim.signals import RobotMode, SafetyMode
from hecbench_hardware.kinematics import UrArm

HOME_RAD = (0.0, -np.pi / 2, np.pi / 2, -np.pi / 2, -np.pi / 2, 0.0)
PROTECTIVE_STOP_LOCKOUT_S = 5.0
FORCE_LIMIT_N = 150.0
CONTACT_STIFFNESS_N_M = 2e4
MAX_JOINT_SPEED_RAD_S = 2 * np.pi
"""Speed of the fastest joints of the e-Series; no joint is driven faster."""
STEADY_RAD_S = 1e-6
HISTORY_CYCLES = 500
_MAX_JOINT_STEP_RAD = 0.5
_LOG_EVENTS, _EVENT_CHARACTERS = 2000, 400


class ScriptError(Exception):
    """A run-time error of the program on the controller (a pose out of reach): the program dies."""

    line: int = 0
    """Line of the program, when it is known."""


class SimulatedArm:
    """State of one arm between cycles. Times are the controller's own, which may run faster than the wall."""

    def __init__(self, arm: UrArm) -> None:
        self.arm = arm
        self.joints = np.array(HOME_RAD)
        self.joint_speeds = np.zeros(6)
        self.joint_accelerations = np.zeros(6)
        self.history: deque[Array] = deque([self.joints], HISTORY_CYCLES)
        """Joints of the last cycles, the newest last."""
        self.flange_T_tcp = np.eye(4)
        self.tcp_offset = np.zeros(6)
        self._seen: tuple[Array | None, Array | None] = (None, None)
        self._tcp_vector: list[float] = []
        self.moved = False
        self._speeds_before = self.joint_speeds
        self._torques_of: tuple[object, ...] = (None,) * 4
        self._torques: list[float] = []
        self.wrench = np.zeros(6)
        """Force and torque at the tool centre point in the base frame, since `zero_force`."""
        self.raw_wrench = np.zeros(6)
        """The same as the sensor feels it, never zeroed."""
        self._wrench_at_zero = np.zeros(6)
        self.external_wrench = [0.0] * 6
        self.external_sensor = False
        """Whether the wrench is the one that a client writes."""
        self.time_s = 0.0
        self.dt_s = 0.002
        self.safety = SafetyMode.NORMAL
        self.robot_mode = RobotMode.RUNNING
        self.stopped_at_s = -np.inf
        self.speed_slider = 1.0
        self.slowdown = 1.0
        self.payload_kg = 0.0
        self.payload_cog_m = [0.0, 0.0, 0.0]
        self.payload_inertia = [0.0] * 6
        self.gravity = [0.0, 0.0, 9.82]
        self.contact_plane_m: float | None = None
        self.external_force_n = 0.0
        self.nothing_reachable = False
        self.io = InputsOutputs()
        self.log: deque[str] = deque(maxlen=_LOG_EVENTS)

    def note(self, text: str) -> None:
        """Remember an event with the controller's time, on one line."""
        line = " ".join(text.split())[:_EVENT_CHARACTERS]
        self.log.append(f"{self.time_s:.3f} {line}")

    def begin_cycle(self) -> None:
        """Advance the clock."""
        self.time_s += self.dt_s
        self.moved = False
        self._speeds_before = self.joint_speeds

    def end_cycle(self) -> None:
        """Stand still if nothing moved the arm; then feel and remember."""
        if not self.moved and self.joint_speeds.any():
            self.joint_speeds = np.zeros(6)
        if self.joint_speeds is not self._speeds_before:
            self.joint_accelerations = (self.joint_speeds - self._speeds_before) / self.dt_s
        elif self.joint_accelerations.any():
            self.joint_accelerations = np.zeros(6)
        self.history.append(self.joints)
        self._update_contact()

    def protective_stop(self, why: str) -> None:
        """Stop as the real one does when it meets resistance or a forbidden target."""
        if self.safety is SafetyMode.NORMAL:
            self.safety, self.stopped_at_s = SafetyMode.PROTECTIVE_STOP, self.time_s
            self.joint_speeds = np.zeros(6)
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
        self.joint_speeds = np.zeros(6)
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

    def set_tcp(self, vector: Array) -> None:
        """Take another tool centre point, as a pose vector (6,) from the flange."""
        self.tcp_offset, self.flange_T_tcp = vector, pose_of(vector)

    def jacobian(self, joints_rad: ArrayLike | None = None, flange_T_tcp: Array | None = None) -> Array:
        """Geometric Jacobian (6, 6) of a tool centre point, the present one by default: [v; w] = J qd, base frame."""
        tool = self.flange_T_tcp if flange_T_tcp is None else flange_T_tcp
        frames = self.arm.link_frames(self.joints if joints_rad is None else joints_rad)
        axes = np.vstack([[0.0, 0.0, 1.0], frames[:5, :3, 2]])
        origins = np.vstack([np.zeros(3), frames[:5, :3, 3]])
        tip = frames[5, :3, :3] @ tool[:3, 3] + frames[5, :3, 3]
        return np.vstack([np.cross(axes, tip - origins).T, axes.T])

    @property
    def tcp_speed(self) -> list[float]:
        """Velocity of the tool centre point [v m/s, w rad/s] in the base frame."""
        if not self.joint_speeds.any():
            return [0.0] * 6
        return [float(x) for x in self.jacobian() @ self.joint_speeds]

    def solve(self, base_T_tcp: Array, near_rad: ArrayLike, flange_T_tcp: Array | None = None) -> Array:
        """The joints (6,) nearest to `near_rad`; raises `ScriptError` when there are none."""
        if not np.isfinite(base_T_tcp).all() or not np.isfinite(near_rad).all():
            raise ScriptError("a pose needs finite numbers")
        tool = self.flange_T_tcp if flange_T_tcp is None else flange_T_tcp
        solutions = self.arm.inverse(base_T_tcp @ se3.inverse(tool), near_rad)
        if self.nothing_reachable or not len(solutions):
            raise ScriptError("getInverseKin: unable to find an inverse kinematics solution")
        return np.asarray(solutions[0])

    def is_reachable(self, base_T_tcp: Array, near_rad: ArrayLike, flange_T_tcp: Array | None = None) -> bool:
        """Whether `solve` finds joints."""
        try:
            self.solve(base_T_tcp, near_rad, flange_T_tcp)
        except ScriptError:
            return False
        return True

    def is_steady(self) -> bool:
        """Whether the arm stands."""
        return bool(np.abs(self.joint_speeds).max() < STEADY_RAD_S)

    @property
    def dynamics(self) -> Dynamics:
        """Of the arm with its present payload."""
        return Dynamics(self.arm, self.payload_kg, tuple(self.payload_cog_m))

    @property
    def torques(self) -> list[float]:
        """Joint torques (6,) Nm of the present motion and of gravity, an estimate; kept while nothing changes."""
        state = (self.joints, self.joint_speeds, self.joint_accelerations, self.payload_kg)
        if any(now is not then for now, then in zip(state, self._torques_of, strict=True)):
            dynamics = self.dynamics
            torques = dynamics.gravity(self.joints, self.gravity)
            torques += dynamics.coriolis(self.joints, self.joint_speeds)
            if self.joint_accelerations.any():
                torques += dynamics.mass_matrix(self.joints) @ self.joint_accelerations
            self._torques_of, self._torques = state, torques.tolist()
        return self._torques

    def push(self, torques: Array) -> None:
        """One cycle under joint torques (6,) Nm beyond those of gravity."""
        require_finite("a torque", torques)
        joints, speeds = self.dynamics.accelerate(self.joints, self.joint_speeds, torques, self.dt_s)
        self.move(joints)
        self.joint_speeds = speeds

    def feels_contact(self, direction: ArrayLike = (0.0, 0.0, 0.0)) -> bool:
        """Whether a force at the tool is against a direction (3,) of the base frame; of any direction without one."""
        along = np.asarray(direction, float)
        return bool(-self.wrench[:3] @ along > 0 if along.any() else self.wrench[:3].any())

    def zero_force(self) -> None:
        """Report forces from here on relative to the present one."""
        self._wrench_at_zero = self.raw_wrench
        self.wrench = np.zeros(6)

    def _update_contact(self) -> None:
        """Set the tool force from the contact plane, and stop above the force limit."""
        force = np.zeros(6)
        depth = 0.0 if self.contact_plane_m is None else self.contact_plane_m - self.base_T_tcp[2, 3]
        force[2] = self.external_force_n + max(0.0, depth) * CONTACT_STIFFNESS_N_M
        if force[2] > FORCE_LIMIT_N:
            self.protective_stop(f"force {force[2]:.0f} N above {FORCE_LIMIT_N:.0f} N")
        self.raw_wrench = np.array(self.external_wrench) if self.external_sensor else force
        self.wrench = self.raw_wrench - self._wrench_at_zero

    def move(self, joints: Array) -> None:
        """Be at these joints (6,) at the end of this cycle."""
        speeds = (joints - self.joints) / self.dt_s
        if not np.abs(joints).max() <= self.arm.joint_range_rad:
            self.protective_stop("a joint at the end of its range")
            return
        self.joint_speeds, self.joints, self.moved = speeds, joints, True

    def move_to(self, base_T_tcp: Array) -> None:
        """Be at this pose (4, 4) at the end of this cycle, without a leap of the joints."""
        joints = self.solve(base_T_tcp, self.joints)
        if np.abs(joints - self.joints).max() > _MAX_JOINT_STEP_RAD:
            raise ScriptError("the linear path meets a singularity")
        self.move(joints)

    def drift(self, tool_twist: Array) -> None:
        """One cycle of a constant tool velocity [v m/s, w rad/s] (6,) in the base frame."""
        require_finite("a tool speed", tool_twist)
        pose = self.base_T_tcp
        rotation = se3.so3_exp(tool_twist[3:] * self.dt_s) @ pose[:3, :3]
        self.move_to(se3.make(rotation, pose[:3, 3] + tool_twist[:3] * self.dt_s))

    def turn(self, joint_speeds: Array) -> None:
        """One cycle of a constant joint velocity (6,) rad/s."""
        require_finite("a joint speed", joint_speeds)
        top = MAX_JOINT_SPEED_RAD_S
        self.move(self.joints + np.clip(joint_speeds, -top, top) * self.dt_s)

    def follow(self, target: Array, top_speed: float) -> None:
        """One cycle towards joints (6,) no faster than `top_speed` rad/s."""
        require_finite("a servo target", target)
        limit = top_speed * self.dt_s
        self.move(self.joints + np.clip(target - self.joints, -limit, limit))


def require_finite(what: str, *values: ArrayLike) -> None:
    """Raise `ScriptError` for an argument that is infinite or no number."""
    if not all(np.isfinite(value).all() for value in values):
        raise ScriptError(f"{what} needs finite numbers")
