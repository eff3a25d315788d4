"""Programs as they arrive on a script port: a block from `def` to its `end`, or a line that stands alone."""

from __future__ import annotations

import re

from hecbench_hardware.controller_sim.arm import ScriptError
from hecbench_hardware.controller_sim.channel import complete_lines
from hecbench_hardware.controller_sim.control_script import MARK, NAME, ControlScript
from hecbench_hardware.controller_sim.program import Program, ProgramRunner
from hecbench_hardware.controller_sim.urscript.check import check_calls
from hecbench_hardware.controller_sim.urscript.library import LIBRARY, motion
from hecbench_hardware.controller_sim.urscript.machine import STRUCT, Machine
from hecbench_hardware.controller_sim.urscript.parser import parse
from hecbench_hardware.controller_sim.urscript.sockets import Sockets
from hecbench_hardware.controller_sim.urscript.syntax import Call, Do, Function
from hecbench_hardware.controller_sim.urscript.tokens import OPENERS

_WORDS = re.compile(r'"[^"\n]*"|#.*|[^\W\d]\w*')


class Uploads:
    """Collects what one client sends and starts each program when it is complete."""

    def __init__(self, runner: ProgramRunner) -> None:
        self._runner = runner
        self._rest = b""
        self._block: list[str] = []
        self._depth = 0
        self._block_bytes = 0

    @property
    def pending_bytes(self) -> int:
        """What waits for its end."""
        return len(self._rest) + self._block_bytes

    def receive(self, data: bytes) -> None:
        """Take a piece of text."""
        lines, self._rest = complete_lines(self._rest + data)
        for line in lines:
            self._add(line)

    def unfinished(self) -> str:
        """The beginning of what has no end yet."""
        return (self._block[0] if self._block else self._rest.decode(errors="replace")).strip()[:60]

    def _add(self, line: str) -> None:
        if not self._block and not line.split("#")[0].strip():
            return
        words = [word for word in _WORDS.findall(line) if word[0] not in '"#']
        self._depth += sum((word in OPENERS) - (word == "end") for word in words)
        self._block.append(line)
        self._block_bytes += len(line) + 1
        if self._depth <= 0:
            text = "\n".join(self._block)
            self._block, self._block_bytes, self._depth = [], 0, 0
            start_program(self._runner, text)


def start_program(runner: ProgramRunner, text: str) -> None:
    """Run a text; one that cannot be executed is reported, and nothing of it runs."""
    try:
        program, name, is_secondary = compiled(runner, text)
    except ScriptError as error:
        runner.kill()
        runner.refuse(str(error), error.line)
        return
    if is_secondary:
        runner.start_secondary(program)
    else:
        runner.start(program, name)


def compiled(runner: ProgramRunner, text: str) -> tuple[Program, str, bool]:
    """The program of a text, its name, and whether it is a secondary one; raises `ScriptError`."""
    if MARK in text:
        return ControlScript(runner, text).run(), NAME, False
    body = parse(text)
    known = {*LIBRARY, STRUCT}
    check_calls(body, known)
    name, is_secondary = "<unnamed>", False
    if len(body) == 1 and isinstance(body[0], Function):
        main = body[0]
        name, is_secondary = main.name, main.word == "sec"
        if is_secondary:
            check_calls(
                body, known - motion.FUNCTIONS.keys(), "takes time, which a secondary program must not"
            )
        body = [main, Do(main.line, Call(main.line, name, [], {}))]
    machine = Machine(runner, Sockets(runner.gripper, runner.host), LIBRARY)
    return machine.run(body), name, is_secondary
