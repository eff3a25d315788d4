"""The simulated controller's process: one thread, one selector, five kinds of port, 500 cycles a second.

The wall clock only paces the cycles; each advances the controller's own time by the same step, so a motion
depends on the cycle at which its command arrived, never on how busy the machine is.
"""

from __future__ import annotations

import re
import selectors
import signal
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import IO

from hecbench.errors import InputError
from hecbench_hardware.controller_sim.arm import SimulatedArm
from hecbench_hardware.controller_sim.dashboard import GREETING, Dashboard
from hecbench_hardware.controller_sim.faults import Faults
from hecbench_hardware.controller_sim.program import CYCLE_S, ProgramRunner
from hecbench_hardware.controller_sim.robotiq import RobotiqSocket
from hecbench_hardware.controller_sim.rtde import RtdeSession, output_values
from hecbench_hardware.kinematics import arm_named

SCRIPT_PORTS = (30001, 30002, 30003)
DASHBOARD_PORT = 29999
RTDE_PORT = 30004
GRIPPER_PORT = 63352
FAULT_PORT = 30099
VERSION = (5, 11, 6, 0)
_LATE_CYCLES = 10
_SLOW_READER_BYTES = 65536


@dataclass
class _Connection:
    socket: socket.socket
    port: int
    session: RtdeSession
    inbox: bytes = b""
    outbox: bytes = b""


@dataclass
class _Server:
    host: str
    version: tuple[int, int, int, int]
    program: ProgramRunner
    selector: selectors.BaseSelector = field(default_factory=selectors.DefaultSelector)
    connections: list[_Connection] = field(default_factory=list)
    owners: dict[str, RtdeSession] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.gripper = RobotiqSocket()
        self.dashboard = Dashboard(self.program, self.version)
        self.faults = Faults(self.dashboard, self.gripper)

    def listen(self) -> None:
        for port in (*SCRIPT_PORTS, DASHBOARD_PORT, RTDE_PORT, GRIPPER_PORT, FAULT_PORT):
            listener = socket.socket()
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                listener.bind((self.host, port))
            except OSError as error:
                raise InputError(
                    f"cannot listen on {self.host}:{port} ({error.strerror}): choose another 127.0.0.x"
                ) from error
            listener.listen(8)
            listener.setblocking(False)
            self.selector.register(listener, selectors.EVENT_READ, partial(self.accept, listener))

    def run(self, go_on: Callable[[], bool]) -> None:
        due = time.monotonic()
        while go_on():
            for key, _ in self.selector.select(max(0.0, due - time.monotonic())):
                if isinstance(key.data, _Connection):
                    self.read(key.data)
                else:
                    key.data()
            now = time.monotonic()
            if now >= due:
                due = now + CYCLE_S if now - due > _LATE_CYCLES * CYCLE_S else due + CYCLE_S
                self.program.step()
                self.gripper.step(self.program.arm.dt_s)
                self.stream(now)

    def close(self) -> None:
        for key in list(self.selector.get_map().values()):
            if isinstance(key.fileobj, socket.socket):
                key.fileobj.close()
        self.selector.close()

    def accept(self, listener: socket.socket) -> None:
        client, _ = listener.accept()
        port = listener.getsockname()[1]
        if port != FAULT_PORT and self.faults.link_is_down:
            client.close()
            return
        client.setblocking(False)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection = _Connection(client, port, RtdeSession(self.owners, self.version))
        self.connections.append(connection)
        self.selector.register(client, selectors.EVENT_READ, connection)
        if port == DASHBOARD_PORT:
            self.send(connection, f"{GREETING}\n".encode())

    def drop(self, connection: _Connection) -> None:
        if connection in self.connections:
            self.connections.remove(connection)
            self.selector.unregister(connection.socket)
            connection.socket.close()
            connection.session.close()

    def send(self, connection: _Connection, data: bytes) -> None:
        connection.outbox += data
        try:
            sent = connection.socket.send(connection.outbox)
        except BlockingIOError:
            return
        except OSError:
            self.drop(connection)
            return
        connection.outbox = connection.outbox[sent:]

    def read(self, connection: _Connection) -> None:
        if connection not in self.connections:
            return
        try:
            data = connection.socket.recv(65536)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self.drop(connection)
            return
        connection.inbox += data
        if connection.port == RTDE_PORT:
            replies, connection.inbox = connection.session.receive(connection.inbox, self.program)
            self.send(connection, replies)
        elif connection.port in SCRIPT_PORTS:
            self.read_programs(connection)
        else:
            self.read_lines(connection)

    def read_programs(self, connection: _Connection) -> None:
        text = connection.inbox.decode(errors="replace")
        while complete := re.match(r"\s*(?:def|sec) \w+\(.*?^end[ \t]*\r?\n", text, re.MULTILINE | re.DOTALL):
            self.program.load(complete[0])
            text = text[complete.end() :]
        connection.inbox = text.encode()

    def read_lines(self, connection: _Connection) -> None:
        *lines, connection.inbox = connection.inbox.split(b"\n")
        for line in (raw.decode(errors="replace") for raw in lines):
            if connection.port == DASHBOARD_PORT:
                self.send(connection, f"{self.dashboard.answer(line)}\n".encode())
            elif connection.port == GRIPPER_PORT:
                self.send(connection, self.gripper.answer(line))
            else:
                self.send(connection, f"{self.faults.answer(line)}\n".encode())
        if self.faults.link_is_down:
            for other in [c for c in self.connections if c.port != FAULT_PORT]:
                self.drop(other)

    def stream(self, now: float) -> None:
        listeners = [
            c for c in self.connections if c.session.streaming and now >= c.session.next_s - CYCLE_S / 4
        ]
        if not listeners or self.faults.stream_frozen:
            return
        values = output_values(self.program)
        for connection in listeners:
            session = connection.session
            session.next_s = max(session.next_s + session.period_s, now)
            if len(connection.outbox) < _SLOW_READER_BYTES:
                self.send(connection, session.packet(values))


def serve(
    host: str,
    *,
    model: str = "ur5e",
    time_scale: float = 1.0,
    version: tuple[int, int, int, int] = VERSION,
    announce: Callable[[str], object] = lambda line: None,
    lifeline: IO[bytes] | None = None,
) -> None:
    """Be a controller at a loopback address until SIGTERM or SIGINT; announces ``ready HOST`` on listening.

    Args:
        host: An address of 127.0.0.0/8; a second controller takes a second address.
        model: ur3e, ur5e or ur10e.
        time_scale: Seconds of the controller's time per second of the wall.
        version: The software version that it claims.
        announce: Called once with the ready line.
        lifeline: The server ends when this stream does, so that it does not outlive its parent.

    Raises:
        InputError: An address outside the loopback range, a taken port, or a time scale not above 0.
    """
    if not re.fullmatch(r"127(\.\d{1,3}){3}", host):
        raise InputError(
            f"the simulated controller serves loopback addresses only, not '{host}': use 127.0.0.2"
        )
    if not time_scale > 0:
        raise InputError(f"the time scale must be positive, not {time_scale}")
    program = ProgramRunner(SimulatedArm(arm_named(model)))
    program.arm.dt_s = CYCLE_S * time_scale
    server = _Server(host, version, program)
    try:
        server.listen()
        stopped: list[bool] = []
        if lifeline:
            server.selector.register(lifeline, selectors.EVENT_READ, lambda: stopped.append(True))
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: stopped.append(True))
        announce(f"ready {host}")
        server.run(lambda: not stopped)
    finally:
        server.close()
