"""Threads for compiled loops, which release the interpreter's lock. Work in them never waits for other such work."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

In = TypeVar("In")
Out = TypeVar("Out")

COUNT = len(os.sched_getaffinity(0))
"""As many as there are cores for this process."""


def each(work: Callable[[In], Out], items: Iterable[In]) -> list[Out]:
    """The work on every item, side by side, in the order of the items."""
    return list(_pool().map(work, items))


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(COUNT)
