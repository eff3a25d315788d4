"""Tasks in several processes at once: workers of this machine, or of a dask cluster.

A task whose process died is tried once more when nothing else runs, its solvers one by one; the one that dies again is
a result with its reason. Workers end with this process, however it ends.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import replace
from os import cpu_count
from threading import local
from typing import Any, Protocol, TypeVar

from hecbench.errors import InputError
from hecbench.running.isolation import Ended, Worker


class Divisible(Protocol):
    """A task of several solvers."""

    @property
    def solvers(self) -> tuple[str, ...]:
        """Their names."""
        ...


TaskT = TypeVar("TaskT", bound=Divisible)


def on_this_machine(
    execute: Callable[..., Any], tasks: Sequence[TaskT], arguments: Sequence[Any], jobs: int
) -> Iterator[tuple[TaskT, Any | Ended]]:
    """Each task with what `execute(task, *arguments)` returned, as they come; jobs -1: one per core."""
    mine, workers, died = local(), list[Worker](), list[TaskT]()

    def call(task: TaskT) -> Any:
        if not hasattr(mine, "worker"):
            mine.worker = Worker()
            workers.append(mine.worker)
        return mine.worker.call(execute, task, *arguments)

    threads = ThreadPoolExecutor(jobs if jobs > 0 else cpu_count() or 1)
    futures = {threads.submit(call, task): task for task in tasks}
    try:
        for future in as_completed(futures):
            task = futures.pop(future)
            try:
                yield task, future.result()
            except Ended:
                died.append(task)
    finally:
        threads.shutdown(wait=False, cancel_futures=True)
        for worker in workers:
            worker.kill()
    yield from _alone(execute, died, arguments)


def _alone(
    execute: Callable[..., Any], tasks: Sequence[TaskT], arguments: Sequence[Any]
) -> Iterator[tuple[TaskT, Any | Ended]]:
    """Every solver of the tasks by itself, in one process."""
    with Worker() as worker:
        for task in tasks:
            for solver in task.solvers:
                part = replace(task, solvers=(solver,))  # type: ignore[type-var]
                try:
                    yield part, worker.call(execute, part, *arguments)
                except Ended as reason:
                    yield part, reason


def on_cluster(
    execute: Callable[..., Any], tasks: Sequence[TaskT], arguments: Sequence[Any], scheduler: str
) -> Iterator[tuple[TaskT, Any | Ended]]:
    """The same on the workers of a dask scheduler, tcp://host:port.

    Raises:
        InputError: dask is not installed, or no scheduler answers.
    """
    try:
        import distributed
    except ImportError:
        raise InputError("--executor needs dask: pip install 'hecbench[cluster]'") from None
    try:
        client = distributed.Client(scheduler, timeout="5s", set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(
            f"--executor {scheduler}: no scheduler answers ({error}); give its tcp://host:port"
        ) from error
    with client, client.as_current():
        futures = {client.submit(execute, task, *arguments, pure=False): task for task in tasks}
        for future in distributed.as_completed(futures):
            task = futures.pop(future)
            try:
                yield task, future.result()
            except distributed.KilledWorker as error:
                yield task, Ended(f"the workers that tried it died ({error})")
