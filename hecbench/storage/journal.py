"""Append-only files of lines, each whole or absent: what results and trials are kept in.

A line is written by one call and flushed to disk, so that a program that is killed loses at most the line it was
writing. Appending starts on a fresh line, whatever came before, and one process writes at a time.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Generic, TypeVar

from hecbench.errors import HecbenchError, InputError
from hecbench.system import files

T = TypeVar("T")


def lines(path: Path) -> Iterator[tuple[int, bytes]]:
    """Number, from 1, and content of every line that is not empty.

    Raises:
        InputError: the file is missing or unreadable.
    """
    with files.reading(path) as stream:
        for number, line in enumerate(stream, start=1):
            if not line.isspace():
                yield number, line.removesuffix(b"\n")


class Writer(Generic[T]):
    """Appends to a file that this process alone has open (see `writing`)."""

    def __init__(self, path: Path, descriptor: int, encode: Callable[[T], bytes]) -> None:
        self._path, self._descriptor, self._encode = path, descriptor, encode

    def append(self, items: Iterable[T]) -> None:
        """Write the items, each as one line, and wait until they are on disk."""
        for item in items:
            line = self._encode(item) + b"\n"
            before = os.fstat(self._descriptor).st_size
            try:
                whole = os.write(self._descriptor, line) == len(line)
            except OSError as error:
                raise HecbenchError(f"{self._path}: cannot be written ({error.strerror})") from error
            if not whole:
                os.ftruncate(self._descriptor, before)
                raise HecbenchError(f"{self._path}: could not be written completely: is the disk full?")
        os.fsync(self._descriptor)


@contextmanager
def writing(
    path: Path, encode: Callable[[T], bytes], *, resume: bool, holds: str, busy: str
) -> Iterator[Writer[T]]:
    """Open a file for appending.

    Args:
        path: Of the file; its folder is made.
        encode: An item as one line, without its break.
        resume: Go on with what the file holds.
        holds: What that is, for errors.
        busy: Who else writes and what to do, for errors.

    Raises:
        InputError: It holds lines and `resume` is False, or another process writes to it.
        HecbenchError: It cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o666)
    except OSError as error:
        raise HecbenchError(f"{path}: cannot be written ({error.strerror}); choose another --out") from error
    try:
        files.keep_others_out(descriptor, f"{path}: {busy} or choose another --out")
        size = os.fstat(descriptor).st_size
        if size and not resume:
            raise InputError(f"{path}: holds {holds} already; give --resume to go on, or another --out")
        if size and os.pread(descriptor, 1, size - 1) != b"\n":
            os.write(descriptor, b"\n")
        yield Writer(path, descriptor, encode)
    finally:
        os.close(descriptor)
