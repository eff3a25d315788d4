"""The folder of a training run: one process at a time, and known to be writable before hours are spent."""

from __future__ import annotations

import fcntl
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hecbench.errors import HecbenchError, InputError


@contextmanager
def reserved(folder: Path) -> Iterator[None]:
    """Make the folder and keep other runs out of it.

    Raises:
        InputError: another process trains into it.
        HecbenchError: it cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            descriptor = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise HecbenchError(
            f"{folder}: cannot be written ({error.strerror}); choose another --out"
        ) from error
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InputError(
                f"{folder}: another process trains into it; wait for it, or choose another --out"
            ) from None
        yield
    finally:
        os.close(descriptor)
