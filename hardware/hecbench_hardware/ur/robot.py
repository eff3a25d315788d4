"""The UR arm behind the `Robot` protocol: read-only until enabled, limits first, polled motions."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from dataclasses import asdict, replace
from typing import Any, Self

import numpy as np

from hecbench import se3
from hecbench.errors import HecbenchError, InputError
from hecbench.se3 import Array
from hecbench_hardware.clearance import check_motion, tool_line
from hecbench_hardware.devices import DeviceFault, Fault, RobotState
from hecbench_hardware.kinematics import Arm
from hecbench_hardware.limits import Limits, Sphere, refuse_too_fast
from hecbench_hardware.motions import JointMotion, LineMotion, motion_time_s, six_joints
from hecbench_hardware.ur import recovery
from hecbench_hardware.ur.control import Control
from hecbench_hardware.ur.dashboard import Dashboard, probe
from hecbench_hardware.ur.outputs import Outputs
from hecbench_hardware.ur.stream import Sample, StateStream, Supervision

STILL_RAD_S = 1e-3
STILL_FOR_S = 0.3
_ARRIVED_RAD = 1e-3
_GAP_M = 0.02
"""More than factory calibration explains: the tool centre point was changed since."""
_NEWS_S = 0.2
"""How long the news may be on its way that a motion has arrived."""


class UrRobot:
    """One arm. Connecting only reads; `enable` takes control."""

    def __init__(
        self,
        host: str,
        arm: Arm,
        *,
        limits: Limits | None = None,
        supervision: Supervision | None = None,
        speed_slider: float | None = None,
    ) -> None:
        """Connect to the state stream.

        Args:
            host: Address of the controller.
            arm: The model that it drives.
            limits: Bounds of every motion.
            supervision: When the supervisor stops the arm.
            speed_slider: `enable` sets the slider to this fraction and `close` sets it back.

        Raises:
            DeviceFault: Nothing answers there.
            InputError: The controller drives another model.
        """
        self.name = f"robot {host}"
        self.host, self.arm = host, arm
        self.supervision = supervision or Supervision()
        probe(host)
        self._dashboard = Dashboard(host, self.supervision.leniency)
        self.simulated = self._dashboard.is_simulated()
        if not self.simulated:
            self.supervision.refuse_blind()
        self._dashboard.refuse_other_model(self.name, arm.name)
        self._carried: tuple[Sphere, ...] = ()
        self.limits = limits or Limits()
        self._control: Control | None = None
        self._speed_slider = speed_slider
        self._slider_before: float | None = None
        self._target: Array | None = None
        self._stream = StateStream(host, self.supervision)

    @property
    def limits(self) -> Limits:
        """Bounds of every motion, with everything that the flange carries: at least a rod to the tool centre point."""
        tool = self._limits.tool + self._carried + tool_line(self._reach())
        return replace(self._limits, tool=tool)

    @limits.setter
    def limits(self, limits: Limits) -> None:
        if not self.simulated:
            refuse_too_fast(limits)
        self._limits = limits

    def carry(self, balls: tuple[Sphere, ...]) -> None:
        """Check every motion for these balls of the flange frame too, a gripper's."""
        self._carried = balls

    @property
    def flange_T_tcp(self) -> Array | None:
        """Tool centre point (4, 4) that is set on the controller; known once enabled."""
        return None if self._control is None else self._control.flange_T_tcp

    def _reach(self) -> Array:
        """The tool centre point (4, 4) in the flange frame, from the state until control was taken."""
        if self.flange_T_tcp is not None:
            return self.flange_T_tcp
        sample = self._stream.latest
        return np.asarray(se3.inverse(self.arm.forward(sample.joints)) @ sample.base_T_tcp)

    def state(self) -> RobotState:
        """The newest state; raises `DeviceFault` when the link is lost or silent."""
        if self._stream.fault and self._stream.link_lost:
            raise self._stream.fault
        return self._stream.latest.state(self.arm, self.flange_T_tcp)

    def describe(self) -> dict[str, Any]:
        """Model, versions, tool offset, and how far our kinematics are from the controller's own pose.

        The controller uses the lengths of its factory calibration, we the nominal ones: the difference, some
        millimetres on a real arm, is part of every hand-eye error.
        """
        state = self.state()
        pair = state.base_T_flange, state.nominal_base_T_flange
        return {
            "model": self.arm.name,
            "host": self.host,
            "simulated": self.simulated,
            "controller": self._dashboard.ask("PolyscopeVersion"),
            "serial_number": self._dashboard.ask("get serial number"),
            "flange_T_tcp": None if self.flange_T_tcp is None else self.flange_T_tcp.tolist(),
            "base_T_tcp": state.base_T_tcp.tolist(),
            "joints_rad": state.joints_rad.tolist(),
            "kinematics_gap_mm": 1e3 * float(se3.translation_error_m(*pair)),
            "kinematics_gap_deg": float(np.degrees(se3.rotation_error_rad(*pair))),
            "limits": asdict(self.limits),
        }

    @property
    def enabled(self) -> bool:
        """Whether the arm can be moved from here."""
        return self._control is not None and self._control.worker.alive

    def enable(self) -> None:
        """Take control: upload the control script, read the tool offset, start to supervise.

        Raises:
            DeviceFault: Local mode, another program or client, a safety stop, power off.
        """
        sample = self._stream.latest
        recovery.refuse_unready(self.name, self._dashboard, sample)
        self._control = Control(self.name, self._dashboard, self._stream, self.supervision)
        if self._speed_slider is not None:
            self._set_slider(self._speed_slider)
            self._slider_before = sample.speed_fraction

    def _set_slider(self, fraction: float) -> None:
        with Outputs(self.host) as outputs:
            outputs.call("setSpeedSlider", fraction)

    def move_joints(self, joints_rad: Array, *, speed_rad_s: float | None = None) -> None:
        """Straight in joint space; the path is checked first.

        Raises:
            InputError: The target or the path leaves the limits, or the arm is read-only.
            DeviceFault: It did not arrive, and why; or an earlier fault was not acknowledged.
        """
        target, limits = six_joints(joints_rad), self.limits
        speed, acceleration = (
            _speed(speed_rad_s, limits.joint_speed_rad_s, "rad/s"),
            limits.joint_acceleration_rad_s2,
        )
        control, start, gap_m = self._ready()
        check_motion(self.arm, JointMotion(self.arm, start, target), limits, gap_m)
        expected_s = motion_time_s(float(np.abs(target - start).max()), speed, acceleration)
        self._target = None
        control.run("moveJ", target.tolist(), speed, acceleration, expected_s)
        self._target = target

    def move_linear(self, base_T_flange: Array, *, speed_m_s: float | None = None) -> None:
        """The tool centre point straight in space, slowed where a joint would be too fast; the path is checked first.

        Raises as `move_joints` does.
        """
        limits = self.limits
        speed, acceleration = _speed(speed_m_s, limits.tool_speed_m_s, "m/s"), limits.tool_acceleration_m_s2
        control, start, gap_m = self._ready()
        line = LineMotion(self.arm, start, np.asarray(base_T_flange, float), control.flange_T_tcp)
        check_motion(self.arm, line, limits, gap_m)
        vector = [*line.base_T_tcp[:3, 3].tolist(), *se3.so3_log(line.base_T_tcp[:3, :3]).tolist()]
        speed = min(speed, line.speed_m_s(limits.joint_speed_rad_s))
        expected_s = motion_time_s(line.length_m, speed, acceleration) + motion_time_s(
            float(np.abs(np.diff(line.joints, axis=0)).sum(axis=0).max()),
            limits.joint_speed_rad_s,
            limits.joint_acceleration_rad_s2,
        )
        self._target = None
        control.run("moveL", vector, speed, acceleration, expected_s)

    def _ready(self) -> tuple[Control, Array, float]:
        """Control; joints (6,) rad from which a motion begins; how far apart the controller's tool and ours are, m."""
        control = self._control
        if fault := self._stream.fault or (control and control.fault):
            raise fault
        if control is None:
            raise InputError(f"{self.name} is read-only: add --arm to let it move")
        sample = self._stream.latest
        ours = self.arm.forward(sample.joints) @ control.flange_T_tcp
        gap_m = float(se3.translation_error_m(sample.base_T_tcp, ours))
        if gap_m > _GAP_M:
            raise InputError(
                f"{self.name}: the tool centre point is {gap_m:.3f} m from where it was set when control was taken:"
                " set it back on the pendant, or start again"
            )
        return control, sample.joints, gap_m

    def settle(self, timeout_s: float = 5.0) -> RobotState:
        """Wait until no joint has moved for a while, and check that the last joint target was reached.

        Raises:
            DeviceFault: The arm does not come to rest, is elsewhere, or the link is lost.
        """
        moved_s, began_s = self._stream.latest.controller_s, time.monotonic()

        def still(sample: Sample) -> bool:
            nonlocal moved_s
            if np.abs(sample.joint_speeds).max() >= STILL_RAD_S:
                moved_s = sample.controller_s
            news = self._gap_rad(sample) <= _ARRIVED_RAD or time.monotonic() - began_s >= _NEWS_S
            return news and sample.controller_s - moved_s >= STILL_FOR_S

        rests = self._stream.wait_for(still, timeout_s)
        if self._stream.fault:
            raise self._stream.fault
        if not rests:
            raise DeviceFault(Fault.LATE, self.name, f"not still after {timeout_s:.1f} s")
        sample = self._stream.latest
        if (gap_rad := self._gap_rad(sample)) > _ARRIVED_RAD:
            raise DeviceFault(Fault.OFF_TARGET, self.name, f"a joint is {gap_rad:.4f} rad off")
        return sample.state(self.arm, self.flange_T_tcp)

    def _gap_rad(self, sample: Sample) -> float:
        """How far the farthest joint is from the last joint target; 0 without one."""
        return 0.0 if self._target is None else float(np.abs(sample.joints - self._target).max())

    def stop(self) -> None:
        """Brake now, from any thread; nothing when read-only."""
        self._target = None
        if self._control is not None:
            self._control.stop()

    def freedrive(self) -> AbstractContextManager[None]:
        """The arm can be guided by hand inside the block."""
        control = self._ready()[0]
        self._target = None
        return control.freedrive()

    def recover(self, acknowledge: Callable[[str], bool]) -> bool:
        """Make ready again after a fault, with the operator's word; False when the operator says no.

        Raises:
            DeviceFault: It cannot be made ready.
        """
        fault = self._stream.fault or (self._control and self._control.fault)
        if not acknowledge(str(fault) if fault else f"{self.name}: take control again"):
            return False
        if self._control is not None:
            self._control.end()
        self._stream.close()
        recovery.make_ready(self.name, self._dashboard)
        self._stream = StateStream(self.host, self.supervision)
        recovery.refuse_unready(self.name, self._dashboard, self._stream.latest)
        self._control = Control(self.name, self._dashboard, self._stream, self.supervision)
        return True

    def close(self) -> None:
        """Stop the arm, end the control script, let go of the controller. May be called twice."""
        control, self._control = self._control, None
        if control is not None:
            control.close()
            if self._slider_before is not None:
                with suppress(HecbenchError):
                    self._set_slider(self._slider_before)
        self._stream.close()

    def __enter__(self) -> Self:
        """The robot itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close."""
        self.close()


def _speed(asked: float | None, limit: float, unit: str) -> float:
    if asked is None:
        return limit
    if not 0 < asked <= limit:
        raise InputError(f"a speed of {asked} {unit} is not above 0 and at most the limit {limit} {unit}")
    return asked
