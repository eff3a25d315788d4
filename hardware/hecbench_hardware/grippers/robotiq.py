"""Robotiq 2F-85 behind the Robotiq URCap of a UR controller: ASCII lines on port 63352.

Variables: Robotiq, "2F-85 & 2F-140 instruction manual", section on the object dictionary; 0 open, 255 closed.
"""

from __future__ import annotations

import contextlib
import re
import socket
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from hecbench.errors import InputError
from hecbench.registry import hookimpl
from hecbench.specs import DeviceSpec, Kind
from hecbench_hardware.devices import DeviceFault, Fault, GripperStatus
from hecbench_hardware.grippers.guard import Guarded
from hecbench_hardware.options import number, text

PORT = 63352
STROKE_M = 0.085
OPEN_COUNT, CLOSED_COUNT = 3, 230
"""Positions at which the pads stand 85 mm apart and touch."""
FORCE_N = (20.0, 235.0)
"""Grip forces of FOR 0 and 255."""
_ACTIVE, _MOVING, _HOLDING = 3, 0, (1, 2)
_POLL_S = 0.01
_ACKNOWLEDGED = b"ack"
"""The answer to SET, which has no newline."""
_ANSWER_BYTES = 1024


@dataclass
class RobotiqGripper(Guarded):
    """Connected; `enable` activates it, which can move the fingers.

    A command that does not end within `timeout_s` is a fault.
    """

    host: str
    timeout_s: float = 5.0

    def __post_init__(self) -> None:
        """Connect."""
        self.name = f"gripper {self.host}"
        try:
            self._socket = socket.create_connection((self.host, PORT), self.timeout_s)
        except OSError as error:
            detail = (
                f"port {PORT} does not answer ({error.strerror or 'time-out'}), is the Robotiq URCap there"
            )
            raise DeviceFault(Fault.GRIPPER, self.name, detail) from None

    def enable(self) -> None:
        """Activate."""
        self._command("SET ACT 1 GTO 1")
        self._wait(lambda: self._get("STA") == _ACTIVE, "it does not become active")
        super().enable()

    def open_fingers(self, width_m: float | None = None) -> None:
        """Open fully, or to a width in metres."""
        width = STROKE_M if width_m is None else width_m
        if not 0 <= width <= STROKE_M:
            raise InputError(f"a width of {width} m is not within 0 to {STROKE_M} m")
        self._go(round(CLOSED_COUNT - width / STROKE_M * (CLOSED_COUNT - OPEN_COUNT)), FORCE_N[0])

    def close_fingers(self, force_n: float | None = None) -> GripperStatus:
        """Close until the pads meet something or each other."""
        force = FORCE_N[0] if force_n is None else force_n
        if not FORCE_N[0] <= force <= FORCE_N[1]:
            raise InputError(f"a force of {force} N is not within {FORCE_N[0]} to {FORCE_N[1]} N")
        self._go(255, force)
        return self.status()

    def status(self) -> GripperStatus:
        """What it does now; raises `DeviceFault` for the gripper's own fault codes."""
        if fault := self._get("FLT"):
            raise DeviceFault(Fault.GRIPPER, self.name, f"fault code {fault}")
        contact, position = self._get("OBJ"), self._get("POS")
        width = STROKE_M * (CLOSED_COUNT - position) / (CLOSED_COUNT - OPEN_COUNT)
        return GripperStatus(min(max(width, 0.0), STROKE_M), contact == _MOVING, contact in _HOLDING)

    def stop(self) -> None:
        """Hold the fingers where they are."""
        if self.enabled:
            self._command("SET GTO 0")

    def close(self) -> None:
        """Disconnect."""
        self._socket.close()

    def _go(self, position: int, force_n: float) -> None:
        self.refuse_disabled()
        force = round(255 * (force_n - FORCE_N[0]) / (FORCE_N[1] - FORCE_N[0]))
        self._command(f"SET POS {position} SPE 255 FOR {force} GTO 1")
        self._wait(
            lambda: self._get("PRE") == position and not self.status().moving, "the fingers do not arrive"
        )

    def _wait(self, done: Callable[[], bool], complaint: str) -> None:
        deadline = time.monotonic() + self.timeout_s
        while not done():
            if time.monotonic() > deadline:
                with contextlib.suppress(DeviceFault):
                    self._command("SET GTO 0")
                raise DeviceFault(Fault.GRIPPER, self.name, f"{complaint} within {self.timeout_s:.1f} s")
            time.sleep(_POLL_S)

    def _get(self, name: str) -> int:
        answer = re.fullmatch(rf"{name} (\d+)", self._exchange(f"GET {name}"))
        if not answer:
            raise DeviceFault(Fault.GRIPPER, self.name, f"no number in answer to GET {name}")
        return int(answer[1])

    def _command(self, line: str) -> None:
        if self._exchange(line) != _ACKNOWLEDGED.decode():
            raise DeviceFault(Fault.GRIPPER, self.name, f"'{line}' was not acknowledged")

    def _exchange(self, line: str) -> str:
        """Send a line and return its whole answer, in however many pieces it comes: `ack`, or a line."""
        answer = b""
        try:
            self._socket.sendall(f"{line}\n".encode())
            while answer != _ACKNOWLEDGED and not answer.endswith(b"\n") and len(answer) < _ANSWER_BYTES:
                piece = self._socket.recv(_ANSWER_BYTES)
                if not piece:
                    raise ConnectionResetError(None, "connection closed")
                answer += piece
            return answer.decode(errors="replace").strip()
        except OSError as error:
            detail = f"no answer to '{line}' ({error.strerror or 'time-out'})"
            raise DeviceFault(Fault.GRIPPER, self.name, detail) from None


def open_robotiq(options: Mapping[str, str]) -> RobotiqGripper:
    """Connect to the gripper of a controller."""
    return RobotiqGripper(text(options, "host"), number(options, "timeout_s", 5.0))


@hookimpl
def hecbench_grippers() -> Iterable[DeviceSpec]:
    """The 2F-85."""
    yield DeviceSpec(
        name="robotiq",
        kind=Kind.GRIPPER,
        summary="Robotiq 2F-85 through its URCap socket",
        open=open_robotiq,
        simulated=False,
        options=("host", "timeout_s"),
    )
