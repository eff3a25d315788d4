"""The estimates that a verb left in a folder: the store of `run`, or the files of `solve` and `calibrate`."""

from __future__ import annotations

from pathlib import Path

from hecbench import estimate
from hecbench.errors import InputError
from hecbench.storage import store
from hecbench.storage.store import Contents

VERDICT_NAME = "verdict.json"


def read(folder: Path) -> Contents:
    """Every estimate in a folder; a store's first, then those of files that are named after their solver.

    Raises:
        InputError: the folder holds none.
    """
    if (folder / store.FILE_NAME).exists():
        return store.read(folder)
    found = []
    for path in sorted(folder.glob("*.json")):
        try:
            read_one = estimate.load(path)
        except InputError:  # another kind of file: the folder may hold a verdict, a recording, a user's notes
            continue
        if path.stem == read_one.solver:
            found.append(read_one)
    return Contents(found, []) if found else store.read(folder)
