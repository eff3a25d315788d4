"""Sockets of a program: to the gripper inside the controller, and to servers on this computer."""

from __future__ import annotations

import socket
from typing import Protocol

from hecbench_hardware.controller_sim.robotiq import RobotiqSocket

GRIPPER_PORT = 63352
SOCKETS = 16
_BUFFER_BYTES = 1 << 16
_LOCAL = ("localhost", "127.")


class Connection(Protocol):
    """One open socket."""

    def send(self, data: bytes) -> bool:
        """Send all of it, or say that it could not be."""

    def receive(self) -> bytes:
        """What arrived since the last call."""

    def close(self) -> None:
        """Hang up."""


class GripperConnection:
    """The URCap of the gripper, which answers at once."""

    def __init__(self, gripper: RobotiqSocket) -> None:
        self._gripper, self._answers = gripper, b""

    def send(self, data: bytes) -> bool:
        """Ask; a request without a newline gets the bare value."""
        text = data.decode(errors="replace")
        self._answers += (
            self._gripper.answer(text) if text.endswith("\n") else self._gripper.answer_bare(text)
        )
        return True

    def receive(self) -> bytes:
        """The answers."""
        answers, self._answers = self._answers, b""
        return answers

    def close(self) -> None:
        """Nothing to free."""


class TcpConnection:
    """A connection to a server on this computer, without waiting."""

    def __init__(self, host: str, port: int) -> None:
        self._socket = socket.socket()
        self._socket.setblocking(False)
        self.failed = False
        try:
            self._socket.connect((host, port))
        except BlockingIOError:
            pass
        except OSError:
            self.failed = True

    def is_connected(self) -> bool:
        """Whether the connection stands; `failed` when it never will."""
        if self.failed or self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR):
            self.failed = True
            return False
        try:
            self._socket.getpeername()
        except OSError:
            return False
        return True

    def send(self, data: bytes) -> bool:
        """Send what fits; the rest would have blocked the program."""
        try:
            return self._socket.send(data) == len(data)
        except OSError:
            return False

    def receive(self) -> bytes:
        """What the kernel has."""
        try:
            return self._socket.recv(_BUFFER_BYTES)
        except OSError:
            return b""

    def close(self) -> None:
        """Hang up."""
        self._socket.close()


class Sockets:
    """The open sockets of a program, by name; the number 1 and the text "1" name the same."""

    def __init__(self, gripper: RobotiqSocket, host: str) -> None:
        self._gripper, self._host = gripper, host
        self._open: dict[str, Connection] = {}
        self._inbox: dict[str, bytes] = {}

    def connect(self, host: str, port: int) -> Connection | None:
        """A new connection, or nothing for an address outside this computer."""
        if port == GRIPPER_PORT and host in ("127.0.0.1", "localhost", self._host):
            return GripperConnection(self._gripper)
        if not host.startswith(_LOCAL) or not 0 < port < 65536:
            return None
        return TcpConnection(host, port)

    def add(self, name: object, connection: Connection) -> None:
        """Keep a connection under a name, in place of the one before."""
        self.close_one(name)
        name = str(name)
        self._open[name], self._inbox[name] = connection, b""

    def __contains__(self, name: object) -> bool:
        """Whether this socket is open."""
        return str(name) in self._open

    def __len__(self) -> int:
        """How many are open."""
        return len(self._open)

    def send(self, name: object, data: bytes) -> bool:
        """Send on a socket; false when it is not open."""
        connection = self._open.get(str(name))
        return connection is not None and connection.send(data)

    def peek(self, name: object) -> bytes:
        """All that arrived and was not taken."""
        name = str(name)
        if name not in self._open:
            return b""
        if len(self._inbox[name]) < _BUFFER_BYTES:
            self._inbox[name] += self._open[name].receive()
        return self._inbox[name]

    def take(self, name: object, count: int) -> bytes:
        """The first bytes of what arrived."""
        name = str(name)
        taken, self._inbox[name] = self._inbox[name][:count], self._inbox[name][count:]
        return taken

    def close_one(self, name: object) -> None:
        """Close a socket; harmless when it is not open."""
        connection = self._open.pop(str(name), None)
        self._inbox.pop(str(name), None)
        if connection:
            connection.close()

    def close(self) -> None:
        """Close all."""
        for name in list(self._open):
            self.close_one(name)
