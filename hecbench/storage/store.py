"""The append-only store of a run: one estimate per line of ``estimates.jsonl``, whole lines or none.

Reading skips what is damaged and says so.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

import msgspec

from hecbench.errors import InputError
from hecbench.estimate import Estimate, decode
from hecbench.storage import journal

FILE_NAME = "estimates.jsonl"

Key = tuple[str | None, str | None, str | None, str, str, int | None, str | None]


def key(estimate: Estimate) -> Key:
    """What makes a result the same result: suite, level, item, recording hash, solver, seed, segmenter."""
    provenance = estimate.provenance
    place = estimate.suite, estimate.level, estimate.item
    run = str(provenance.get("recording_sha256")), estimate.solver, provenance.get("seed")
    return *place, *run, provenance.get("masks")


class _Provenance(msgspec.Struct, gc=False):
    recording_sha256: str | None = None
    seed: int | None = None
    masks: str | None = None


class _Label(msgspec.Struct, gc=False):
    """What `key` needs of a line; all else is passed over."""

    solver: str
    provenance: _Provenance
    suite: str | None = None
    level: str | None = None
    item: str | None = None


def keys(folder: Path) -> set[Key]:
    """The keys of what a store holds, in a tenth of the time and memory of `read`.

    Raises:
        InputError: there is no store in the folder.
    """
    decoder = msgspec.json.Decoder(_Label)
    found: set[Key] = set()
    for _, line in journal.lines(_file(folder)):
        try:
            label = decoder.decode(line)
        except (msgspec.DecodeError, UnicodeDecodeError):
            continue  # damaged: `read` says so, and the result is made again
        run = label.provenance
        place = label.suite, label.level, label.item
        found.add((*place, str(run.recording_sha256), label.solver, run.seed, run.masks))
    return found


def _file(folder: Path) -> Path:
    path = folder / FILE_NAME
    if not folder.is_dir() or not path.exists():
        raise InputError(
            f"{folder}: holds no results ({FILE_NAME}); make some with `hecbench run --out {folder}`"
        )
    return path


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
    path = _file(folder)
    estimates: dict[Key, Estimate] = {}
    damage = []
    for number, line in journal.lines(path):
        try:
            estimate = decode(line, f"{path}:{number}")
        except InputError:
            damage.append(
                f"{path}:{number}: damaged, {len(line)} bytes skipped; `run --resume` makes it again"
            )
        else:
            estimates.setdefault(key(estimate), estimate)
    return Contents(list(estimates.values()), damage)


def writing(folder: Path, *, resume: bool) -> AbstractContextManager[journal.Writer[Estimate]]:
    """Open a store for appending.

    Raises:
        InputError: it holds results and `resume` is False, or another process writes to it.
        HecbenchError: the folder cannot be written.
    """
    return journal.writing(
        folder / FILE_NAME,
        lambda estimate: msgspec.json.encode(estimate.to_json()),
        resume=resume,
        holds="results",
        busy="another run is writing here; wait for it",
    )
