"""Files that are whole or absent: written aside, then renamed; and kept by one process."""

from __future__ import annotations

import fcntl
import hashlib
import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from hecbench.errors import HecbenchError, InputError


@contextmanager
def replacing(path: Path) -> Iterator[IO[bytes]]:
    """Open a temporary neighbour for writing; rename it to `path` on success, remove it on any failure.

    Raises:
        HecbenchError: the folder cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor, aside = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    except OSError as error:
        raise HecbenchError(f"{path}: cannot be written ({error.strerror}); choose another place") from error
    try:
        with os.fdopen(descriptor, "wb") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        umask = os.umask(0)
        os.umask(umask)
        Path(aside).chmod(0o666 & ~umask)
        Path(aside).replace(path)
    except BaseException:
        Path(aside).unlink(missing_ok=True)
        raise


def keep_others_out(descriptor: int, refusal: str) -> None:
    """Lock an open file or folder for this process, until it is closed.

    Raises:
        InputError: another process has it; `refusal` is its message.
    """
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        raise InputError(refusal) from None


def write_bytes(path: Path, content: bytes) -> None:
    """Write a whole file or none."""
    with replacing(path) as stream:
        stream.write(content)


def write_text(path: Path, content: str) -> None:
    """Write a whole UTF-8 file or none."""
    write_bytes(path, content.encode())


def read_bytes(path: Path) -> bytes:
    """Read a regular file; a pipe or device, which may never end, is refused.

    Raises:
        InputError: it is missing, unreadable or no regular file.
    """
    with reading(path) as stream:
        return stream.read()


@contextmanager
def reading(path: Path) -> Iterator[IO[bytes]]:
    """Open a regular file; errors as for `read_bytes`."""
    try:
        if path.exists() and not path.is_file():
            raise InputError(f"{path}: cannot be read (it is no regular file); give a file")
        with path.open("rb") as stream:
            yield stream
    except FileNotFoundError:
        raise InputError(f"{path}: does not exist; check the path") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check its permissions") from error


_LONGEST_NAME = 100
"""Characters; file systems allow 255 bytes, and a suffix or a counter may follow."""


def safe_name(text: str) -> str:
    """A file name, without a folder, for a name that data chose; different names stay different.

    Letters, digits and ``_ . -`` stay; what is replaced or cut is stood for by a digest.
    """
    name = re.sub(r"[^\w.-]", "_", text)[:_LONGEST_NAME].lstrip(".")
    return name if name == text else f"{name}-{hashlib.sha256(text.encode()).hexdigest()[:8]}"
