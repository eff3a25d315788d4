"""Motions of the arm."""

from __future__ import annotations

from typing import Final

import numpy as np

from hecbench.se3 import Array
from hecbench_hardware.controller_sim.arm import ScriptError
from hecbench_hardware.controller_sim.force import ForceTask
from hecbench_hardware.controller_sim.geometry import vector_of
from hecbench_hardware.controller_sim.motions import (
    Motion,
    brake,
    move_circular,
    move_joints,
    move_linear,
)
from hecbench_hardware.controller_sim.urscript.functions import builtins
from hecbench_hardware.controller_sim.urscript.machine import Machine
from hecbench_hardware.controller_sim.urscript.values import Pose, Value, number, pose, vector


def joints_of(m: Machine, q: Value) -> Array:
    """Joints (6,), or those nearest to the present ones of a pose."""
    return m.arm.solve(q.matrix, m.arm.joints) if isinstance(q, Pose) else vector(q, 6, "the joints")


def pose_of_target(m: Machine, target: Value) -> Array:
    """A pose (4, 4), or that of joints."""
    if isinstance(target, Pose):
        return target.matrix
    return np.asarray(m.arm.arm.forward(vector(target, 6, "the target")) @ m.arm.flange_T_tcp)


def movej(m: Machine, q: Value, a: Value = 1.4, v: Value = 1.05, t: Value = 0, r: Value = 0) -> Motion:
    """Straight in joint space; the arm stops at the point."""
    joints = joints_of(m, q)
    m.waypoint = vector_of(m.arm.arm.forward(joints) @ m.arm.flange_T_tcp)
    return move_joints(m.arm, joints, number(v), number(a), number(t))


def movel(m: Machine, pose: Value, a: Value = 1.2, v: Value = 0.25, t: Value = 0, r: Value = 0) -> Motion:
    """Straight in space."""
    target = pose_of_target(m, pose)
    m.waypoint = vector_of(target)
    return move_linear(m.arm, target, number(v), number(a), number(t))


def movep(m: Machine, pose: Value, a: Value = 1.2, v: Value = 0.25, r: Value = 0) -> Motion:
    """Straight in space at constant tool speed; here as `movel`."""
    return movel(m, pose, a, v, 0, r)


def movec(
    m: Machine,
    pose_via: Value,
    pose_to: Value,
    a: Value = 1.2,
    v: Value = 0.25,
    r: Value = 0,
    mode: Value = 0,
) -> Motion:
    """Along a circle; the orientation turns evenly to that of the target."""
    via, target = pose_of_target(m, pose_via), pose_of_target(m, pose_to)
    m.waypoint = vector_of(target)
    return move_circular(m.arm, via, target, number(v), number(a))


def optimovej(m: Machine, q: Value, a: Value = 0.3, v: Value = 0.3, r: Value = 0) -> Motion:
    """As `movej`, at fractions of the top acceleration and speed."""
    return movej(m, q, number(a) * _TOP_ACCELERATION_RAD_S2, number(v) * _TOP_SPEED_RAD_S)


def optimovel(m: Machine, pose: Value, a: Value = 0.3, v: Value = 0.3, r: Value = 0) -> Motion:
    """As `movel`, at fractions of the top acceleration and speed."""
    return movel(m, pose, number(a) * _TOP_ACCELERATION_M_S2, number(v) * _TOP_SPEED_M_S)


def servoj(
    m: Machine,
    q: Value,
    a: Value = 0,
    v: Value = 0,
    t: Value = 0.002,
    lookahead_time: Value = 0.1,
    gain: Value = 300,
) -> Motion:
    """Towards joints for the time t, as fast as the joints may."""
    target, end = joints_of(m, q), m.arm.time_s + max(number(t), m.arm.dt_s)
    while m.arm.time_s < end - m.arm.dt_s / 2:
        m.arm.follow(target, _SERVO_SPEED_RAD_S)
        yield


def servoc(m: Machine, pose: Value, a: Value = 1.2, v: Value = 0.25, r: Value = 0) -> Motion:
    """Towards a pose for one cycle."""
    m.arm.follow(joints_of(m, pose), _SERVO_SPEED_RAD_S)
    yield


def _ramp(now: Array, target: Array, acceleration: float, dt_s: float) -> Array:
    change = target - now
    step = max(acceleration, 1e-3) * dt_s
    return np.asarray(now + change * min(1.0, step / max(float(np.abs(change).max()), 1e-12)))


def speedj(m: Machine, qd: Value, a: Value, t: Value = 0) -> Motion:
    """Joint speeds, for the time t or until they are reached; the arm stands when nothing follows."""
    target, end, reached = vector(qd, 6, "qd"), m.arm.time_s + number(t), False
    while m.arm.time_s < end or not reached:
        speeds = _ramp(m.arm.joint_speeds, target, number(a), m.arm.dt_s)
        m.arm.turn(speeds)
        reached = bool(np.abs(speeds - target).max() < 1e-9) or number(t) > 0
        yield


def speedl(m: Machine, xd: Value, a: Value, t: Value = 0, aRot: Value = "a") -> Motion:
    """A tool velocity in the base frame, as `speedj` holds joint speeds."""
    target, end, reached = vector(xd, 6, "xd"), m.arm.time_s + number(t), False
    while m.arm.time_s < end or not reached:
        twist = _ramp(np.array(m.arm.tcp_speed), target, number(a), m.arm.dt_s)
        m.arm.drift(twist)
        reached = bool(np.abs(twist - target).max() < 1e-6) or number(t) > 0
        yield


def stopj(m: Machine, a: Value = 2.0) -> Motion:
    """Brake all joints at one pace."""
    return brake(m.arm, number(a))


def stopl(m: Machine, a: Value, aRot: Value = "a") -> Motion:
    """Brake the tool; here at the pace at which the joints carry it."""
    speed = float(np.linalg.norm(m.arm.tcp_speed[:3]))
    fastest = float(np.abs(m.arm.joint_speeds).max())
    return brake(m.arm, number(a) * fastest / speed if speed > 1e-6 else number(a))


def direct_torque(
    m: Machine,
    torque: Value,
    friction_comp: Value = True,
    viscous_scale: Value = None,
    coulomb_scale: Value = None,
) -> Motion:
    """Joint torques beyond those of gravity, for one cycle; the friction of the drives is not compensated."""
    m.arm.push(vector(torque, 6, "torque"))
    yield


def sleep(m: Machine, t: Value) -> Motion:
    """Wait, in the controller's time."""
    end = m.arm.time_s + number(t)
    while m.arm.time_s < end:
        yield


def sync(m: Machine) -> Motion:
    """The rest of this cycle."""
    yield


def force_mode(
    m: Machine, task_frame: Value, selection_vector: Value, wrench: Value, type: Value, limits: Value
) -> None:
    """Force control, as an admittance; only type 2, the frame as given, is simulated."""
    if type != 2:
        raise ScriptError("only force type 2 is simulated")
    m.runner.force = ForceTask(
        pose(task_frame, "task_frame")[:3, :3],
        vector(selection_vector, 6, "selection_vector").astype(bool),
        vector(wrench, 6, "wrench"),
        vector(limits, 6, "limits"),
    )


def end_force_mode(m: Machine) -> None:
    """Position control again."""
    m.runner.force = None


def freedrive_mode(m: Machine, freeAxes: Value = None, feature: Value = None) -> None:
    """Let the arm be guided by hand; all axes are free."""
    m.runner.freedrive = True


def end_freedrive_mode(m: Machine) -> None:
    """Hold again."""
    m.runner.freedrive = False


def teach_mode(m: Machine) -> None:
    """The older name of freedrive."""
    m.runner.freedrive = True


def end_teach_mode(m: Machine) -> None:
    """Hold again."""
    m.runner.freedrive = False


_SERVO_SPEED_RAD_S = np.pi
_TOP_SPEED_RAD_S, _TOP_ACCELERATION_RAD_S2 = np.pi, 10.0
_TOP_SPEED_M_S, _TOP_ACCELERATION_M_S2 = 1.0, 5.0

FUNCTIONS: Final = builtins(
    movej,
    movel,
    movep,
    movec,
    optimovej,
    optimovel,
    servoj,
    servoc,
    speedj,
    speedl,
    stopj,
    stopl,
    direct_torque,
    sleep,
    sync,
    force_mode,
    end_force_mode,
    freedrive_mode,
    end_freedrive_mode,
    teach_mode,
    end_teach_mode,
)
