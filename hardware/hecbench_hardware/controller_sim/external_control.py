"""The program with the maker's External Control URCap in it: it fetches its script from the client's computer."""

from __future__ import annotations

from collections.abc import Generator

from hecbench_hardware.controller_sim.arm import ScriptError
from hecbench_hardware.controller_sim.program import Program, ProgramRunner
from hecbench_hardware.controller_sim.urscript.sockets import TcpConnection
from hecbench_hardware.controller_sim.urscript.uploads import compiled

PROGRAM = "external_control.urp"
"""The one program that is stored on the simulated controller."""
HOST, PORT = "127.0.0.1", 50002
REQUEST = b"request_program\n"
_CONNECT_S, _SILENCE_S, _PATIENCE_S = 2.0, 0.2, 10.0
_SCRIPT_BYTES = 1 << 20


def external_control(runner: ProgramRunner) -> Program:
    """Fetch the script and run it."""
    connection = TcpConnection(HOST, PORT)
    try:
        end = runner.wall_s + _CONNECT_S
        while not connection.is_connected():
            if connection.failed or runner.wall_s > end:
                raise ScriptError(f"External Control: nobody serves a program at {HOST}:{PORT}")
            yield
        connection.send(REQUEST)
        text = yield from _received(runner, connection)
    finally:
        connection.close()
    yield from compiled(runner, text)[0]


def _received(runner: ProgramRunner, connection: TcpConnection) -> Generator[None, None, str]:
    """The text up to a silence, for its sender keeps the connection open."""
    content, last, end = b"", runner.wall_s, runner.wall_s + _PATIENCE_S
    while not content or runner.wall_s - last < _SILENCE_S:
        if piece := connection.receive():
            content, last = content + piece, runner.wall_s
        if len(content) > _SCRIPT_BYTES or (runner.wall_s > end and not content):
            raise ScriptError(f"External Control: {len(content)} bytes are no program")
        yield
    return content.decode(errors="replace")
