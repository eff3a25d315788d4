"""The append-only store of a run: one estimate per line of ``estimates.jsonl``, whole lines or none.

A line is written by a single call and flushed to disk, so a run that is killed loses at most the line it was
writing; reading skips what is damaged and says so. Appending starts on a fresh line, whatever came before.
"""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import msgspec

from hecbench import files
from hecbench.errors import HecbenchError, InputError
from hecbench.estimate import Estimate, decode

FILE_NAME = "estimates.jsonl"

Key = tuple[str | None, str | None, str | None, str, str, int | None]


def key(estimate: Estimate) -> Key:
    """What makes a result the same result: suite, level, item, recording hash, solver, seed."""
    provenance = estimate.provenance
    place = estimate.suite, estimate.level, estimate.item
    return *place, str(provenance.get("recording_sha256")), estimate.solver, provenance.get("seed")


@dataclass(frozen=True)
class Contents:
    """What a store holds.

    Attributes:
        estimates: in the order written; a result written twice counts once, the first time.
        damage: one sentence for each damaged line.
    """

    estimates: list[Estimate]
    damage: list[str]


def read(folder: Path) -> Contents:
    """Read every whole line of a store.

    Raises:
        InputError: there is no store in the folder.
    """
    path = folder / FILE_NAME
    if not folder.is_dir() or not path.exists():
        raise InputError(
            f"{folder}: holds no results ({FILE_NAME}); make some with `hecbench run --out {folder}`"
        )
    estimates: dict[Key, Estimate] = {}
    damage = []
    for number, line in enumerate(files.read_bytes(path).split(b"\n"), start=1):
        if not line.strip():
            continue
        try:
            estimate = decode(line, f"{path}:{number}")
        except InputError:
            damage.append(
                f"{path}:{number}: damaged, {len(line)} bytes skipped; `run --resume` makes it again"
            )
        else:
            estimates.setdefault(key(estimate), estimate)
    return Contents(list(estimates.values()), damage)


class Writer:
    """Appends to a store that this process alone has open (see `writing`)."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor

    def append(self, estimates: Iterable[Estimate]) -> None:
        """Write the estimates, each as one line, and wait until they are on disk."""
        for estimate in estimates:
            line = msgspec.json.encode(estimate.to_json()) + b"\n"
            if os.write(self._descriptor, line) != len(line):
                raise HecbenchError("the store could not be written completely: is the disk full?")
        os.fsync(self._descriptor)


@contextmanager
def writing(folder: Path, *, resume: bool) -> Iterator[Writer]:
    """Open a store for appending.

    Raises:
        InputError: it holds results and `resume` is False, or another process writes to it.
        HecbenchError: the folder cannot be written.
    """
    path = folder / FILE_NAME
    try:
        folder.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o666)
    except OSError as error:
        raise HecbenchError(f"{path}: cannot be written ({error.strerror}); choose another --out") from error
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InputError(
                f"{path}: another run is writing here; wait for it or choose another --out"
            ) from None
        size = os.fstat(descriptor).st_size
        if size and not resume:
            raise InputError(f"{path}: holds results already; give --resume to go on, or another --out")
        if size and os.pread(descriptor, 1, size - 1) != b"\n":
            os.write(descriptor, b"\n")
        yield Writer(descriptor)
    finally:
        os.close(descriptor)
