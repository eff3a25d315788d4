"""Sockets of a program. Time-outs run by the wall clock, for the other side lives by it; 0 waits for ever."""

from __future__ import annotations

import struct
from collections.abc import Callable, Generator
from math import nan
from typing import Any, Final

from hecbench_hardware.controller_sim.arm import ScriptError
from hecbench_hardware.controller_sim.urscript.functions import builtins
from hecbench_hardware.controller_sim.urscript.machine import Machine
from hecbench_hardware.controller_sim.urscript.sockets import SOCKETS, TcpConnection
from hecbench_hardware.controller_sim.urscript.values import Value, number, text, text_of, truth, whole

Waiting = Generator[None, None, Any]

_NAME = "socket_0"
_CONNECT_S, _READ_S = 2.0, 2.0
_NUMBERS = 30
"""The most numbers that one reading function takes, by the maker's manual."""


def socket_open(m: Machine, address: Value, port: Value, socket_name: Value = _NAME) -> Waiting:
    """Whether a connection stands; only to this computer."""
    if len(m.sockets) >= SOCKETS and socket_name not in m.sockets:
        raise ScriptError(f"more than {SOCKETS} sockets")
    connection = m.sockets.connect(text(address, "address"), whole(port, "port"))
    if connection is None:
        m.arm.note(f"socket_open({address}, {port}): only this computer's own addresses are simulated")
        return False
    end = m.runner.wall_s + _CONNECT_S
    while isinstance(connection, TcpConnection) and not connection.is_connected():
        if connection.failed or m.runner.wall_s > end:
            connection.close()
            return False
        yield
    m.sockets.add(socket_name, connection)
    return True


def socket_close(m: Machine, socket_name: Value = _NAME) -> None:
    """Close it."""
    m.sockets.close_one(socket_name)


def socket_send_string(m: Machine, str_: Value, socket_name: Value = _NAME) -> bool:
    """A text as it is."""
    return m.sockets.send(socket_name, text_of(str_).encode())


def socket_send_line(m: Machine, str_: Value, socket_name: Value = _NAME) -> bool:
    """A text and a newline."""
    return m.sockets.send(socket_name, f"{text_of(str_)}\n".encode())


def socket_send_int(m: Machine, value: Value, socket_name: Value = _NAME) -> bool:
    """Four bytes, the highest first."""
    return m.sockets.send(socket_name, struct.pack(">I", whole(value) & 0xFFFFFFFF))


def socket_send_byte(m: Machine, value: Value, socket_name: Value = _NAME) -> bool:
    """One byte."""
    return m.sockets.send(socket_name, bytes([whole(value) & 0xFF]))


def socket_set_var(m: Machine, name: Value, value: Value, socket_name: Value = _NAME) -> bool:
    """The line `SET name value`."""
    return m.sockets.send(socket_name, f"SET {text(name)} {whole(value)}\n".encode())


def socket_get_var(m: Machine, name: Value, socket_name: Value = _NAME) -> Waiting:
    """The number that answers the line `GET name`."""
    m.sockets.send(socket_name, f"GET {text(name)}\n".encode())
    line = yield from _awaited(m, socket_name, _READ_S, _through(b"\n"))
    words = line.decode(errors="replace").split()
    return int(words[1]) if len(words) == 2 and words[1].lstrip("-").isdecimal() else 0


def socket_read_line(m: Machine, socket_name: Value = _NAME, timeout: Value = _READ_S) -> Waiting:
    """A line without its end; empty after the time-out."""
    line = yield from _awaited(m, socket_name, number(timeout), _through(b"\n"))
    return line.decode(errors="replace").rstrip("\r\n")


def socket_read_string(
    m: Machine,
    socket_name: Value = _NAME,
    prefix: Value = "",
    suffix: Value = "",
    interpret_escape: Value = False,
    timeout: Value = _READ_S,
) -> Waiting:
    """What arrived, or what stands between a prefix and a suffix; empty after the time-out."""
    end, begin = text(suffix, "suffix"), text(prefix, "prefix")
    if truth(interpret_escape, "interpret_escape"):
        end = end.replace("\\n", "\n").replace("\\r", "\r")
    found = yield from _awaited(m, socket_name, number(timeout), _through(end.encode()) if end else len)
    content = found.decode(errors="replace").removesuffix(end) if end else found.decode(errors="replace")
    return content.partition(begin)[2] if begin else content


def socket_read_byte_list(
    m: Machine, number_: Value, socket_name: Value = _NAME, timeout: Value = _READ_S
) -> Waiting:
    """How many bytes were read, then the bytes."""
    count = _count(number_)
    found = yield from _awaited(m, socket_name, number(timeout), _exactly(count))
    return [len(found), *found] if found else [0, *[nan] * count]


def socket_read_binary_integer(
    m: Machine, number_: Value, socket_name: Value = _NAME, timeout: Value = _READ_S
) -> Waiting:
    """How many integers of four bytes were read, then the integers."""
    count = _count(number_)
    found = yield from _awaited(m, socket_name, number(timeout), _exactly(4 * count))
    return [count, *struct.unpack(f">{count}i", found)] if found else [0, *[nan] * count]


def socket_read_ascii_float(
    m: Machine, number_: Value, socket_name: Value = _NAME, timeout: Value = _READ_S
) -> Waiting:
    """How many numbers were read of a text `(1.0, 2.0)`, then the numbers."""
    count = _count(number_)
    found = yield from _awaited(m, socket_name, number(timeout), _through(b")"))
    words = found.decode(errors="replace").strip().strip("()").split(",")
    try:
        values = [float(word) for word in words]
    except ValueError:
        values = []
    return [count, *values] if len(values) == count else [0, *[nan] * count]


def _count(value: Value) -> int:
    if not 0 < number(value, "the count") <= _NUMBERS:
        raise ScriptError(f"1 to {_NUMBERS} values can be read at once, not {text_of(value)}")
    return whole(value, "the count")


def _exactly(count: int) -> Callable[[bytes], int]:
    return lambda arrived: count if len(arrived) >= count else 0


def _through(end: bytes) -> Callable[[bytes], int]:
    return lambda arrived: arrived.find(end) + len(end) if end in arrived else 0


def _awaited(
    m: Machine, socket_name: str, timeout_s: float, wanted: Callable[[bytes], int]
) -> Generator[None, None, bytes]:
    """The first bytes of a socket, as soon as `wanted` counts more than none; none after the time-out."""
    end = m.runner.wall_s + timeout_s if timeout_s > 0 else float("inf")
    while socket_name in m.sockets:
        if count := wanted(m.sockets.peek(socket_name)):
            return m.sockets.take(socket_name, count)
        if m.runner.wall_s >= end:
            break
        yield
    return b""


FUNCTIONS: Final = builtins(
    socket_open,
    socket_close,
    socket_send_string,
    socket_send_line,
    socket_send_int,
    socket_send_byte,
    socket_set_var,
    socket_get_var,
    socket_read_line,
    socket_read_string,
    socket_read_byte_list,
    socket_read_binary_integer,
    socket_read_ascii_float,
)
