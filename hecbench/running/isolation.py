"""A solver in a process of its own, so that one which crashes the interpreter or never returns costs its row only."""

from __future__ import annotations

import ctypes
import os
import pickle
import resource
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Timer
from typing import Any

from hecbench.errors import HecbenchError

_SERVE = "from hecbench.running import isolation; isolation.serve({parent}, {memory})"
_PR_SET_PDEATHSIG = 1
"""prctl(2): the signal that the kernel sends when the parent dies."""


class Ended(Exception):
    """The process ended before it answered; the message says how."""


class TookTooLong(Exception):
    """There was no answer within the time allowed, and the process was ended."""


@contextmanager
def stdout_to_stderr() -> Iterator[None]:
    """Whatever is printed meanwhile, by Python or below it, goes to stderr: stdout carries the answer alone."""
    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(kept, 1)
        os.close(kept)


class Worker:
    """A process that calls functions, one after the other; it starts with the first call and again after its end."""

    def __init__(self, timeout_s: float | None = None, memory_mb: int | None = None) -> None:
        self._timeout_s, self._memory_mb = timeout_s, memory_mb
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Worker:
        return self

    def __exit__(self, *error: object) -> None:
        self._end()

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """What a module's function returns; what it raises is raised here.

        Raises:
            Ended: the process ended without an answer.
            TookTooLong: it was ended because the time was over.
        """
        if self._process is None:
            code = _SERVE.format(parent=os.getpid(), memory=self._memory_mb)
            self._process = subprocess.Popen(
                [sys.executable, "-c", code],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                start_new_session=True,  # Ctrl-C is the parent's to handle
            )
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        over: list[bool] = []

        def end_it() -> None:
            over.append(True)
            process.kill()

        timer = Timer(self._timeout_s, end_it) if self._timeout_s is not None else None
        if timer is not None:
            timer.start()
        try:
            process.stdin.write(pickle.dumps((function, arguments)))
            process.stdin.flush()
            answer = pickle.load(process.stdout)
        except (EOFError, OSError, pickle.UnpicklingError) as error:
            self._end()
            if over:
                raise TookTooLong(f"no answer within {self._timeout_s:g} s") from error
            raise Ended(_how(process.returncode)) from error
        finally:
            if timer is not None:
                timer.cancel()
        if isinstance(answer, Exception):
            raise answer
        return answer

    def kill(self) -> None:
        """End the process now, from any thread; a call that waits for it raises `Ended`."""
        if (process := self._process) is not None:
            process.kill()

    def _end(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None


def _how(returncode: int) -> str:
    if returncode == -signal.SIGKILL:
        return "its process was ended by SIGKILL (out of memory?)"
    if returncode < 0:
        return f"its process ended by {signal.Signals(-returncode).name}"
    return "its process ended without an answer"


def serve(parent: int, memory_mb: int | None) -> None:
    """Answer requests from stdin until it is closed; stdout carries answers, everything printed goes to stderr.

    The process ends with its parent, even when that is killed, and gets a `MemoryError` above `memory_mb` of data.
    """
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        return
    if memory_mb is not None:
        resource.setrlimit(resource.RLIMIT_DATA, (memory_mb * 2**20,) * 2)
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    while True:
        try:
            function, arguments = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        try:
            answer = function(*arguments)
        except Exception as error:  # whatever it is, the caller decides
            answer = _portable(error)
        answers.write(_packed(answer))
        answers.flush()


def _packed(answer: Any) -> bytes:
    try:
        return pickle.dumps(answer)
    except Exception as error:  # pickle has no base class of its own for what it cannot carry
        return pickle.dumps(Ended(f"its answer cannot be pickled: {error}"))


def _portable(error: Exception) -> Exception:
    """Errors that the caller knows as they are, and the text of all others, which may refuse to travel in any way."""
    known = isinstance(error, HecbenchError)
    return error if known else Ended(f"crashed with {type(error).__name__}: {error}")
