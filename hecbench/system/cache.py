"""What was computed once, kept in the user's cache folder: never beside the user's own files."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import sqlite3

VARIABLE = "HECBENCH_NO_CACHE"
"""Of the environment: while it is set and not empty nothing is looked up or kept; `--no-cache` sets it."""
_WAIT_S = 5.0
"""For another process that is writing."""


def folder() -> Path:
    """Ours in the user's cache folder (XDG base directory specification)."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "hecbench"


class Cache:
    """Values by keys in one file, shared by processes and threads.

    A file that cannot be used costs time and a warning, never an answer.

    Args:
        name: of the file in `folder()`.
        most_bytes: when the values take more, the older half of them is dropped.
    """

    def __init__(self, name: str, most_bytes: int) -> None:
        self.name, self.most_bytes = name, most_bytes

    def get(self, key: bytes) -> bytes | None:
        """The value of a key, or None."""
        found = self._execute("SELECT value FROM entry WHERE key = ?", [(key,)])
        return found[0] if found else None

    def put(self, values: Mapping[bytes, bytes]) -> None:
        """Keep values; of a key that is there, the new one."""
        self._execute("INSERT OR REPLACE INTO entry (key, value) VALUES (?, ?)", values.items())

    def _execute(self, statement: str, rows: Iterable[tuple[bytes, ...]]) -> list[bytes]:
        """What the statement finds for the rows, in one transaction; nothing where there is no usable file."""
        if os.environ.get(VARIABLE):
            return []
        import logging
        import sqlite3

        path = folder() / self.name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with closing(sqlite3.connect(path, timeout=_WAIT_S)) as file, file:
                file.execute("CREATE TABLE IF NOT EXISTS entry (key BLOB UNIQUE, value BLOB)")
                found = [row[0] for given in rows for row in file.execute(statement, given)]
                self._bound(file)
                return found
        except (OSError, sqlite3.Error) as error:
            logging.getLogger(__name__).warning(
                "%s: cannot be used (%s); delete it, or set %s=1", path, error, VARIABLE
            )
            return []

    def _bound(self, file: sqlite3.Connection) -> None:
        pages, free, size = (
            file.execute(f"PRAGMA {what}").fetchone()[0]
            for what in ("page_count", "freelist_count", "page_size")
        )
        if (pages - free) * size > self.most_bytes:
            file.execute("DELETE FROM entry WHERE rowid <= (SELECT (min(rowid) + max(rowid)) / 2 FROM entry)")
