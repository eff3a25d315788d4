"""Threads of a URScript program: one generator each, a turn of each in every cycle of the controller."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hecbench_hardware.controller_sim.arm import ScriptError

if TYPE_CHECKING:
    from hecbench_hardware.controller_sim.program import ProgramRunner
    from hecbench_hardware.controller_sim.urscript.sockets import Sockets

Steps = Generator[None, None, Any]
"""Runs for any number of cycles, then has a result."""

_STATEMENTS_PER_CYCLE = 400
"""What a thread may do in one cycle; the rest waits for the next, as on a processor that is busy."""
_CRITICAL_STATEMENTS = 4000
"""How much longer a critical section may go on."""
_THREADS = 64


class Halted(Exception):
    """The program asked to end."""


@dataclass(eq=False)
class Thread:
    """A running thread; equal only to itself, so never to the number 0."""

    steps: Steps
    line: int = 0
    alive: bool = True
    budget: int = _STATEMENTS_PER_CYCLE
    depth: int = 0


class Scheduler:
    """The threads of one run of one program."""

    def __init__(self, runner: ProgramRunner, sockets: Sockets) -> None:
        self.runner, self.sockets = runner, sockets
        self._threads: list[Thread] = []
        self.current: Thread | None = None
        """The thread whose turn it is."""
        self.critical: Thread | None = None
        """The thread that is not interrupted; what takes time lets the others have their turns all the same."""

    def take_turns(self, steps: Steps) -> Steps:
        """One turn of every thread per cycle; the program ends with its first thread."""
        main = self.spawn(steps)
        try:
            while main.alive:
                for thread in list(self._threads):
                    if thread.alive:
                        self._turn(thread)
                if main.alive:
                    yield
        except Halted:
            pass
        finally:
            self.sockets.close()

    def spend(self, thread: Thread) -> bool:
        """Count a statement; true when the thread has to wait for the next cycle."""
        thread.budget -= 1
        return thread.budget < (-_CRITICAL_STATEMENTS if self.critical is thread else 0)

    def _turn(self, thread: Thread) -> None:
        self.current, thread.budget = thread, _STATEMENTS_PER_CYCLE
        try:
            next(thread.steps)
        except StopIteration:
            self.kill(thread)
        except ScriptError as error:
            error.line = error.line or thread.line
            raise
        except RecursionError:
            raise ScriptError("expressions too deeply nested") from None
        self.runner.line = thread.line

    def spawn(self, steps: Steps) -> Thread:
        """Start a thread."""
        self._threads = [thread for thread in self._threads if thread.alive]
        if len(self._threads) >= _THREADS:
            raise ScriptError(f"more than {_THREADS} threads")
        thread = Thread(steps)
        self._threads.append(thread)
        return thread

    def kill(self, thread: Thread) -> None:
        """End a thread."""
        thread.alive = False
        if self.critical is thread:
            self.critical = None
        if thread is not self.current:
            thread.steps.close()
