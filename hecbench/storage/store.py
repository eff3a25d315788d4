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
