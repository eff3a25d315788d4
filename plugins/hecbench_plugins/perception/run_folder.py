"""The folder of a training run: one process at a time, and known to be writable before hours are spent."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hecbench.errors import HecbenchError
from hecbench.system import files


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
        files.keep_others_out(
            descriptor, f"{folder}: another process trains into it; wait for it, or choose another --out"
        )
        yield
    finally:
        os.close(descriptor)
