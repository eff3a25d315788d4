"""The command line, run in this process: what a process of its own would print, and its exit code."""

import os
import signal
import subprocess
import sys
import tempfile
from contextlib import ExitStack, chdir, contextmanager, redirect_stderr, redirect_stdout

import pytest

from hecbench.commands import cli


@contextmanager
def descriptor_into(number, file):
    """What is written to a file descriptor, by Python or below it, goes into a file."""
    kept = os.dup(number)
    os.dup2(file.fileno(), number)
    try:
        with open(number, "w", closefd=False) as stream:
            yield stream
    finally:
        os.dup2(kept, number)
        os.close(kept)


@contextmanager
def as_before():
    """Restores what the command line changes in its process."""
    words, environment, handler = sys.argv, dict(os.environ), signal.getsignal(signal.SIGTERM)
    try:
        yield
    finally:
        sys.argv = words
        os.environ.clear()
        os.environ.update(environment)
        signal.signal(signal.SIGTERM, handler)


def run(*arguments, cwd=None):
    words = ["hecbench", *map(str, arguments)]
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        with ExitStack() as changed:
            changed.enter_context(as_before())
            changed.enter_context(chdir(cwd or os.getcwd()))
            changed.enter_context(redirect_stdout(changed.enter_context(descriptor_into(1, out))))
            changed.enter_context(redirect_stderr(changed.enter_context(descriptor_into(2, err))))
            sys.argv = words
            try:
                cli.main()
            except SystemExit as end:
                code = end.code or 0
            else:
                code = 0
        for file in (out, err):
            file.seek(0)
        return subprocess.CompletedProcess(words, code, out.read(), err.read())


@pytest.fixture(scope="session")
def hecbench():
    """Run the command line as a user does."""
    return run


@pytest.fixture(scope="session")
def refused():
    """Assert exit code 2 and one line on stderr that holds every part."""

    def check(finished, *parts):
        assert finished.returncode == 2, finished.stderr
        assert finished.stdout == ""
        assert finished.stderr.startswith("hecbench: ")
        assert finished.stderr.count("\n") == 1
        for part in parts:
            assert part in finished.stderr

    return check
