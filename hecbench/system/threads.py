"""Threads for compiled loops, which release the interpreter's lock. Work in them never waits for other such work."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

from hecbench.errors import InputError

In = TypeVar("In")
Out = TypeVar("Out")

VARIABLE = "HECBENCH_THREADS"
"""Of the environment: the most threads of this process and of those that it starts."""


@cache
def count() -> int:
    """As many as the process has cores, or fewer where `VARIABLE` says so.

    Raises:
        InputError: `VARIABLE` is no positive integer.
    """
    cores = len(os.sched_getaffinity(0))
    if (said := os.environ.get(VARIABLE)) is None:
        return cores
    if not said.isdecimal() or int(said) == 0:
        raise InputError(f"{VARIABLE}={said}: give a number of threads, 1 or more")
    return min(cores, int(said))


def limit(most: int) -> None:
    """Let this process, and those that it starts, use at most so many threads from now on."""
    os.environ[VARIABLE] = str(most)
    count.cache_clear()
    _pool.cache_clear()


def each(work: Callable[[In], Out], items: Iterable[In]) -> list[Out]:
    """The work on every item, side by side, in the order of the items: the same answers for every `count`."""
    if count() == 1:
        return [work(item) for item in items]
    return list(_pool().map(work, items))


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(count())
