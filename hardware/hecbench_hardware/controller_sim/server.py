"""The simulated controller's process: one thread, one selector, its ports, 500 cycles a second.

The wall clock only paces the cycles; each advances the controller's own time by the same step, so a motion
depends on the cycle at which its command arrived, never on how busy the machine is. Whatever one client sends
can cost that client its connection, never another one, never the process.
"""

from __future__ import annotations

import errno
import os
import re
import selectors
import signal
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import IO

import numpy as np

from hecbench.errors import InputError
from hecbench_hardware.controller_sim.arm import SimulatedArm
from hecbench_hardware.controller_sim.channel import Channel, Finished, LineChannel, Refused
from hecbench_hardware.controller_sim.client_interfaces import SCRIPT_PORTS, ClientInterfaces
from hecbench_hardware.controller_sim.dashboard import GREETING, Dashboard
from hecbench_hardware.controller_sim.faults import Faults
from hecbench_hardware.controller_sim.program import CYCLE_S, ProgramRunner
from hecbench_hardware.controller_sim.robotiq import RobotiqSocket
from hecbench_hardware.controller_sim.rtde import RtdeSession
from hecbench_hardware.kinematics import arm_named

DASHBOARD_PORT = 29999
RTDE_PORT = 30004
GRIPPER_PORT = 63352
FAULT_PORT = 30099
VERSION = (5, 11, 6, 0)
_BACKLOG = 512
_LATE_CYCLES = 10
_READ_BYTES = 65536
_SLOW_READER_BYTES = 65536
"""A client this far behind misses stream frames, as it would find only the newest on a real controller."""
_DEAF_READER_BYTES = 1 << 20
"""A client this far behind does not read its answers."""


@dataclass
class _Connection:
    socket: socket.socket
    port: int
    channel: Channel
    outbox: bytes = b""
    hears: bool = True
    """Whether the client still takes data; what it sent before it left is read all the same."""


@dataclass
class _Server:
    host: str
    version: tuple[int, int, int, int]
    program: ProgramRunner
    selector: selectors.BaseSelector = field(default_factory=selectors.DefaultSelector)
    connections: dict[socket.socket, _Connection] = field(default_factory=dict)
    owners: dict[str, RtdeSession] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.gripper = self.program.gripper
        self.dashboard = Dashboard(self.program, self.version)
        self.faults = Faults(self.dashboard, self.gripper)
        self.interfaces = ClientInterfaces(self.program, self.version)
        self.spare = os.open(os.devnull, os.O_RDONLY)

    def channel(self, port: int) -> Channel:
        """A conversation for a new client of a port."""
        if port == RTDE_PORT:
            return RtdeSession(self.program, self.version, self.owners)
        if port == DASHBOARD_PORT:
            return LineChannel(self.dashboard.reply, f"{GREETING}\n".encode())
        if port == GRIPPER_PORT:
            return LineChannel(self.gripper.answer)
        if port == FAULT_PORT:
            return LineChannel(lambda line: f"{self.faults.answer(line)}\n".encode())
        return self.interfaces.channel(port)

    def listen(self) -> None:
        for port in (*SCRIPT_PORTS, DASHBOARD_PORT, RTDE_PORT, GRIPPER_PORT, FAULT_PORT):
            listener = socket.socket()
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                listener.bind((self.host, port))
            except OSError as error:
                listener.close()
                raise InputError(
                    f"cannot listen on {self.host}:{port} ({error.strerror}): choose another 127.0.0.x"
                ) from error
            listener.listen(_BACKLOG)
            listener.setblocking(False)
            self.selector.register(listener, selectors.EVENT_READ, partial(self.accept, listener))

    def run(self, go_on: Callable[[], bool]) -> None:
        due = time.monotonic()
        while go_on():
            for key, events in self.selector.select(max(0.0, due - time.monotonic())):
                if not isinstance(key.data, _Connection):
                    key.data()
                elif events & selectors.EVENT_READ:
                    self.read(key.data)
                else:
                    self.send(key.data, b"")
            now = time.monotonic()
            if now >= due:
                due = now + CYCLE_S if now - due > _LATE_CYCLES * CYCLE_S else due + CYCLE_S
                self.advance()
                self.stream(now)

    def advance(self) -> None:
        try:
            self.program.step()
        except Exception as error:  # a fault of the simulation: it costs the program, and is on record
            self.program.refuse(f"the simulation failed: {type(error).__name__}: {error}")
            self.program.kill()

    def close(self) -> None:
        for key in list(self.selector.get_map().values()):
            if isinstance(key.fileobj, socket.socket):
                key.fileobj.close()
        self.selector.close()
        os.close(self.spare)
        self.program.kill()

    def accept(self, listener: socket.socket) -> None:
        try:
            client, _ = listener.accept()
        except OSError as error:
            if error.errno in (errno.EMFILE, errno.ENFILE):
                self.refuse_one(listener)
            return
        port = listener.getsockname()[1]
        if port != FAULT_PORT and self.faults.link_is_down:
            client.close()
            return
        client.setblocking(False)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection = _Connection(client, port, self.channel(port))
        self.connections[client] = connection
        self.selector.register(client, selectors.EVENT_READ, connection)
        self.send(connection, connection.channel.opened())

    def refuse_one(self, listener: socket.socket) -> None:
        """No file descriptor is left: take the client with the one kept for this, and hang up."""
        self.program.arm.note("a client was refused: too many connections")
        os.close(self.spare)
        try:
            listener.accept()[0].close()
        except OSError:  # it hung up by itself, which is as good
            pass
        finally:
            self.spare = os.open(os.devnull, os.O_RDONLY)

    def drop(self, connection: _Connection, why: str = "") -> None:
        if self.connections.pop(connection.socket, None):
            if why:
                self.program.arm.note(f"port {connection.port}: {why}; connection closed")
            self.selector.unregister(connection.socket)
            connection.socket.close()
            connection.channel.close()

    def send(self, connection: _Connection, data: bytes) -> None:
        """Send what the socket takes, and the rest when it takes more."""
        if connection.socket not in self.connections or not connection.hears:
            return
        connection.outbox += data
        try:
            sent = connection.socket.send(connection.outbox) if connection.outbox else 0
        except BlockingIOError:
            sent = 0
        except OSError:
            connection.hears, sent = False, len(connection.outbox)
        connection.outbox = connection.outbox[sent:]
        if len(connection.outbox) > _DEAF_READER_BYTES:
            self.drop(connection, "it does not read its answers")
            return
        waiting = selectors.EVENT_WRITE if connection.outbox else 0
        self.selector.modify(connection.socket, selectors.EVENT_READ | waiting, connection)

    def read(self, connection: _Connection) -> None:
        if connection.socket not in self.connections:
            return
        try:
            data = connection.socket.recv(_READ_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self.drop(connection)
            return
        self.send(connection, self.said(connection, partial(connection.channel.receive, data)))
        if self.faults.link_is_down:
            for other in [c for c in self.connections.values() if c.port != FAULT_PORT]:
                self.drop(other)

    def said(self, connection: _Connection, say: Callable[[], bytes]) -> bytes:
        """What a channel has to say; its end or its fault ends its connection."""
        try:
            return say()
        except Finished as end:
            self.send(connection, end.last)
            self.drop(connection)
        except Refused as error:
            self.drop(connection, str(error))
        except Exception as error:  # a fault of the simulation: it costs this connection, and is on record
            self.drop(connection, f"{type(error).__name__}: {error}")
        return b""

    def stream(self, now: float) -> None:
        if self.faults.stream_frozen:
            return
        for connection in list(self.connections.values()):
            if len(connection.outbox) < _SLOW_READER_BYTES:
                data = self.said(connection, partial(connection.channel.stream, now))
                if data:
                    self.send(connection, data)


def version_of(text: str) -> tuple[int, int, int, int]:
    """The software version that a text like 5.11.6.0 names; what is left out is 0.

    Raises:
        InputError: it is none that the messages on the ports can carry.
    """
    parts = text.split(".") if re.fullmatch(r"[0-9]{1,5}(\.[0-9]{1,5}){1,3}", text) else ["256"]
    major, minor, bugfix, build = (*map(int, parts), 0, 0, 0)[:4]
    if max(major, minor) > 255:
        raise InputError(f"'{text}' is no software version: give it like 5.11.6.0")
    return major, minor, bugfix, build


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
    if not 0 < time_scale < float("inf"):
        raise InputError(f"the time scale must be positive, not {time_scale}")
    arm = SimulatedArm(arm_named(model))
    arm.dt_s = CYCLE_S * time_scale
    server = _Server(host, version, ProgramRunner(arm, RobotiqSocket(), host))
    np.seterr(over="ignore", invalid="ignore")  # what clients send is judged where it is used
    _ = arm.tcp_vector  # the first pose loads SciPy, which would hold up the cycles later
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
