"""OnRobot RG2 on a Compute Box: Modbus TCP, unit 65.

Registers: OnRobot, "Connectivity guide", RG2; widths in 0.1 mm, forces in 0.1 N. The few Modbus frames needed
are written here (Modbus Organization, "Modbus application protocol specification" V1.1b3, functions 3, 16).
"""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from hecbench.errors import InputError
from hecbench.registry import hookimpl
from hecbench.specs import DeviceSpec, Kind
from hecbench_hardware.devices import DeviceFault, Fault, GripperStatus
from hecbench_hardware.grippers.guard import Guarded
from hecbench_hardware.options import number, text

UNIT = 65
STROKE_M, MAX_FORCE_N = 0.11, 40.0
_TARGET_FORCE, _WIDTH, _STATUS = 0, 267, 268
_GRIP, _STOP = 1, 8
_BUSY, _HOLDING, _SAFETY = 1 << 0, 1 << 1, 0b1111100
_READ, _WRITE = 3, 16
_POLL_S = 0.02
_SHORTEST_BODY = 2
"""Function code and exception."""


@dataclass
class OnRobotGripper(Guarded):
    """Connected. A command that does not end within `timeout_s` is a fault."""

    host: str
    port: int = 502
    timeout_s: float = 5.0

    def __post_init__(self) -> None:
        """Connect."""
        self.name = f"gripper {self.host}"
        self._transaction = 0
        try:
            self._socket = socket.create_connection((self.host, self.port), self.timeout_s)
        except OSError as error:
            detail = f"port {self.port} does not answer ({error.strerror or 'time-out'}), is it a Compute Box"
            raise DeviceFault(Fault.GRIPPER, self.name, detail) from None

    def open_fingers(self, width_m: float | None = None) -> None:
        """Open fully, or to a width in metres."""
        self._go(STROKE_M if width_m is None else width_m, MAX_FORCE_N)

    def close_fingers(self, force_n: float | None = None) -> GripperStatus:
        """Close until the pads meet something or each other."""
        self._go(0.0, MAX_FORCE_N / 2 if force_n is None else force_n)
        return self.status()

    def status(self) -> GripperStatus:
        """What it does now; raises `DeviceFault` when a safety switch is triggered."""
        width, bits = self._read(_WIDTH, 2)
        if bits & _SAFETY:
            raise DeviceFault(Fault.GRIPPER, self.name, f"safety switch, status {bits:#b}")
        return GripperStatus(width * 1e-4, bool(bits & _BUSY), bool(bits & _HOLDING))

    def stop(self) -> None:
        """Hold the fingers where they are."""
        if self.enabled:
            self._write(_TARGET_FORCE + 2, [_STOP])

    def close(self) -> None:
        """Disconnect."""
        self._socket.close()

    def _go(self, width_m: float, force_n: float) -> None:
        self.refuse_disabled()
        if not 0 <= width_m <= STROKE_M:
            raise InputError(f"a width of {width_m} m is not within 0 to {STROKE_M} m")
        if not 0 < force_n <= MAX_FORCE_N:
            raise InputError(f"a force of {force_n} N is not within 0 to {MAX_FORCE_N} N")
        self._write(_TARGET_FORCE, [round(force_n * 10), round(width_m * 1e4), _GRIP])
        deadline = time.monotonic() + self.timeout_s
        while self.status().moving:
            if time.monotonic() > deadline:
                self.stop()
                detail = f"the fingers do not arrive within {self.timeout_s:.1f} s"
                raise DeviceFault(Fault.GRIPPER, self.name, detail)
            time.sleep(_POLL_S)

    def _read(self, address: int, count: int) -> tuple[int, ...]:
        body = self._exchange(struct.pack(">BHH", _READ, address, count))
        if len(body) != 2 + 2 * count:
            raise DeviceFault(Fault.GRIPPER, self.name, f"{len(body)} bytes instead of {count} registers")
        return struct.unpack(f">{count}H", body[2:])

    def _write(self, address: int, values: list[int]) -> None:
        count = len(values)
        self._exchange(struct.pack(f">BHHB{count}H", _WRITE, address, count, 2 * count, *values))

    def _exchange(self, request: bytes) -> bytes:
        """Send one request and return the body of its reply, function code first."""
        self._transaction = (self._transaction + 1) % 65536
        header = struct.pack(">HHHB", self._transaction, 0, len(request) + 1, UNIT)
        try:
            self._socket.sendall(header + request)
            length = struct.unpack(">HHHB", self._receive(7))[2]
            body = self._receive(max(length - 1, _SHORTEST_BODY))
        except OSError as error:
            raise DeviceFault(
                Fault.GRIPPER, self.name, f"no answer ({error.strerror or 'time-out'})"
            ) from None
        if body[0] != request[0]:
            raise DeviceFault(Fault.GRIPPER, self.name, f"Modbus exception {body[-1]}")
        return body

    def _receive(self, count: int) -> bytes:
        content = b""
        while len(content) < count:
            piece = self._socket.recv(count - len(content))
            if not piece:
                raise ConnectionResetError(None, "connection closed")
            content += piece
        return content


def open_onrobot(options: Mapping[str, str]) -> OnRobotGripper:
    """Connect to a Compute Box."""
    port = int(number(options, "port", 502))
    return OnRobotGripper(text(options, "host"), port, number(options, "timeout_s", 5.0))


@hookimpl
def hecbench_grippers() -> Iterable[DeviceSpec]:
    """The RG2."""
    yield DeviceSpec(
        name="onrobot_rg2",
        kind=Kind.GRIPPER,
        summary="OnRobot RG2 on a Compute Box, Modbus TCP",
        open=open_onrobot,
        simulated=False,
        options=("host", "port", "timeout_s"),
    )
