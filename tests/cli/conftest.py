"""The installed command."""

import subprocess
import sys
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def hecbench():
    """Run the command line as a user does."""

    def run(*arguments, cwd=None):
        command = [Path(sys.executable).parent / "hecbench", *map(str, arguments)]
        return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=240, check=False)

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
