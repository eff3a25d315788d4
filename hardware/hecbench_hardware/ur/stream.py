"""The state stream and its supervisor: every sample is judged as it arrives, and silence is judged too."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hecbench import se3
from hecbench.errors import HecbenchError, InputError
from hecbench.se3 import Array
from hecbench_hardware.devices import DeviceFault, Fault, RobotState
from hecbench_hardware.kinematics import Arm
from hecbench_hardware.ur.process import Worker, WorkerGone
from hecbench_hardware.ur.worker import CONNECT_S, SAMPLE

_RUNNING_MODE = 7
_PLAYING = 2
_SAFETY = {
    3: Fault.PROTECTIVE_STOP,
    6: Fault.EMERGENCY_STOP,
    7: Fault.EMERGENCY_STOP,
    4: Fault.SAFETY_STOP,
    5: Fault.SAFETY_STOP,
    8: Fault.SAFETY_STOP,
    9: Fault.SAFETY_STOP,
}
"""Faults by `safety_mode`; 1 (normal) and 2 (reduced) may move."""
_LINK = (Fault.LINK_LOST, Fault.STALE)


_CONNECTS = 3
MOST = {"max_age_s": 1.0, "max_force_n": 150.0, "leniency": 10.0}
"""For a real arm: at top speed it covers half a metre in a second, and above 150 N its controller stops by itself."""
LAG_S = 0.1
"""How long a state may wait until this process judges it."""


@dataclass(frozen=True)
class Supervision:
    """When the supervisor stops the arm, and how long a motion may take."""

    max_age_s: float = 0.1
    """Of the newest state, by this computer's clock."""
    max_force_n: float = 100.0
    """Norm of the tool force."""
    late_s: float = 1.0
    """Past its expected time a motion counts as late."""
    leniency: float = 1.0
    """Times the usual time for an answer of the controller and its clients; more for a busy machine."""

    def __post_init__(self) -> None:
        """Refuse what would stop the arm always."""
        for name in ("max_age_s", "max_force_n", "late_s", "leniency"):
            if not getattr(self, name) > 0:
                raise InputError(f"{name}={getattr(self, name)} must be above 0")

    @property
    def patience_s(self) -> float:
        """How old the state that was judged last may be while the arm is on its way."""
        return self.max_age_s + LAG_S

    def refuse_blind(self) -> None:
        """Raise an `InputError` for what a real arm may not be driven with."""
        for name, most in MOST.items():
            if getattr(self, name) > most:
                raise InputError(
                    f"{name}={getattr(self, name)} is above the most allowed for a real arm, {most}"
                )


@dataclass(frozen=True)
class Sample:
    """One sample of the stream. `arrived_s` is this computer's monotonic clock."""

    arrived_s: float
    controller_s: float
    connected: bool
    robot_mode: int
    safety_mode: int
    playing: bool
    speed_scaling: float
    speed_fraction: float
    digital_outputs: int
    joints: Array
    joint_speeds: Array
    tcp_vector: Array
    wrench: Array

    @classmethod
    def unpack(cls, content: bytes) -> Sample:
        """Read what `worker.receive` packs."""
        arrived, clock, connected, mode, safety, _, _, runtime, scaling, slider, outputs, *rest = (
            SAMPLE.unpack(content)
        )
        vectors = np.array(rest).reshape(4, 6)
        return cls(
            arrived, clock, bool(connected), int(mode), int(safety), int(runtime) == _PLAYING,
            scaling, slider, int(outputs), *vectors,
        )  # fmt: skip

    @property
    def base_T_tcp(self) -> Array:
        """The controller's pose (4, 4)."""
        return se3.from_rotvec(self.tcp_vector[3:], self.tcp_vector[:3])

    def state(self, arm: Arm, flange_T_tcp: Array | None) -> RobotState:
        """The same for users; the tool offset (4, 4) is unknown until control was taken."""
        nominal = arm.forward(self.joints)
        return RobotState(
            joints_rad=self.joints,
            joint_speeds_rad_s=self.joint_speeds,
            base_T_flange=nominal if flange_T_tcp is None else self.base_T_tcp @ se3.inverse(flange_T_tcp),
            nominal_base_T_flange=nominal,
            base_T_tcp=self.base_T_tcp,
            wrench=self.wrench,
            robot_stamp_s=self.controller_s,
            host_stamp_s=time.time() - (time.monotonic() - self.arrived_s),
            speed_fraction=self.speed_fraction,
        )


def fault_of(sample: Sample) -> tuple[Fault, str] | None:
    """Why this controller may not move its arm, and what it says; None when it may."""
    if sample.safety_mode in _SAFETY:
        return _SAFETY[sample.safety_mode], f"safety mode {sample.safety_mode}"
    if sample.robot_mode != _RUNNING_MODE:
        return Fault.POWER_OFF, f"robot mode {sample.robot_mode}"
    return None


class StateStream:
    """Reads samples in a thread of its own. The first fault stays until `close`; a lost link overrides it."""

    def __init__(self, host: str, supervision: Supervision) -> None:
        """Connect read-only and wait for the first sample.

        Raises:
            DeviceFault: The controller does not stream.
        """
        self._device = f"robot {host}"
        self._supervision = supervision
        self._worker, self.latest = self._connected(host)
        self.fault: DeviceFault | None = None
        self._changed_s = self.latest.arrived_s
        self._news = threading.Condition()
        self._on_fault: Callable[[Fault], None] | None = None
        self._on_judged: Callable[[float], None] | None = None
        self._closing = False
        self._thread = threading.Thread(target=self._read, name=f"{host} supervisor", daemon=True)
        self._thread.start()

    def _connected(self, host: str) -> tuple[Worker, Sample]:
        """A worker and its first sample; the client can crash when a slow controller lets it wait for that one.

        Another attempt is made while one as long as the last still fits into the time for connecting.
        """
        detail, end_s = "", time.monotonic() + CONNECT_S * self._supervision.leniency
        for _ in range(_CONNECTS):
            began_s = time.monotonic()
            worker = Worker("receive", host, leniency=self._supervision.leniency)
            try:
                worker.ready()
                return worker, Sample.unpack(worker.connection.recv_bytes())
            except (EOFError, OSError):
                detail = "the client ended before the first state"
                worker.end()
                now_s = time.monotonic()
                if now_s + (now_s - began_s) > end_s:
                    break
            except (WorkerGone, HecbenchError) as error:
                detail = str(error)
                break
        raise DeviceFault(Fault.LINK_LOST, self._device, f"no state stream, {detail}")

    @property
    def pid(self) -> int:
        """Process id of the worker."""
        return self._worker.pid

    def supervise(self, on_fault: Callable[[Fault], None], on_judged: Callable[[float], None]) -> None:
        """From now on every fault counts, not only a lost link; each is reported, and when each good state arrived."""
        self._on_fault, self._on_judged = on_fault, on_judged

    def wait_for(self, done: Callable[[Sample], bool], timeout_s: float) -> bool:
        """Wait until a sample satisfies `done`; False after the time-out or when the link is lost."""
        with self._news:
            return self._news.wait_for(lambda: done(self.latest) or self.link_lost, timeout_s) and (
                not self.link_lost
            )

    @property
    def link_lost(self) -> bool:
        """Whether no more state comes."""
        return self.fault is not None and self.fault.fault in _LINK

    def close(self) -> None:
        """End the worker and the thread."""
        self._closing = True
        self._worker.kill()
        self._thread.join()
        self._worker.end()
        self.fault = DeviceFault(Fault.LINK_LOST, self._device, "it was closed")

    def _read(self) -> None:
        connection, limit_s = self._worker.connection, self._supervision.max_age_s
        while not self._closing:
            try:
                if connection.poll(limit_s):
                    self._take(Sample.unpack(connection.recv_bytes()))
                age_s = time.monotonic() - self._changed_s
                is_stale = age_s > limit_s and not connection.poll(0)
            except (EOFError, OSError):
                self._raise(Fault.LINK_LOST, "the client ended")
                return
            if is_stale:
                self._raise(Fault.STALE, f"the newest state is {age_s:.2f} s old, {limit_s:.2f} s allowed")

    def _take(self, sample: Sample) -> None:
        if sample.controller_s != self.latest.controller_s:
            self._changed_s = sample.arrived_s
        with self._news:
            self.latest = sample
            self._news.notify_all()
        if not sample.connected:
            self._raise(Fault.LINK_LOST, "the connection is closed")
        elif self._on_fault:
            self._judge(sample)

    def _judge(self, sample: Sample) -> None:
        force_n = float(np.linalg.norm(sample.wrench[:3]))
        if found := fault_of(sample):
            self._raise(*found)
        elif force_n > self._supervision.max_force_n:
            self._raise(Fault.FORCE, f"{force_n:.0f} N, {self._supervision.max_force_n:.0f} N allowed")
        elif self._on_judged and self.fault is None:
            self._on_judged(sample.arrived_s)

    def _raise(self, fault: Fault, detail: str) -> None:
        if self._closing or self.link_lost or (self.fault and fault not in _LINK):
            return
        self.fault = DeviceFault(fault, self._device, detail)
        with self._news:
            self._news.notify_all()
        if self._on_fault:
            self._on_fault(fault)
