"""Plan = recordings x solvers -> a store of estimates, one recording after the other or in parallel."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hecbench import diagnose, registry
from hecbench.estimate import Estimate, Status, Termination
from hecbench.preparation import load_recording, prepare, segmented
from hecbench.recording import Recording
from hecbench.running import pool
from hecbench.running.calibrating import evidence_from
from hecbench.running.isolation import Ended
from hecbench.running.solving import Options, each_solved, provenance
from hecbench.specs import Kind, SolverSpec, SuiteSpec
from hecbench.storage import evidence, store
from hecbench.storage.evidence import Evidence
from hecbench.system import threads


@dataclass(frozen=True)
class Task:
    """One recording, from disk or from a suite, and the solvers to run on it."""

    solvers: tuple[str, ...]
    path: Path | None = None
    suite: str | None = None
    level: str | None = None
    index: int = 0

    def recording(self, seed: int) -> Recording:
        """Load or generate it."""
        if self.path is not None:
            return load_recording(self.path)
        suite = registry.load().get(Kind.SUITE, str(self.suite), SuiteSpec)
        return suite.make(str(self.level), self.index, seed)

    def facts(self, seed: int) -> Mapping[str, float]:
        """What the suite tells about the item beside its recording."""
        if self.path is not None:
            return {}
        return (
            registry.load()
            .get(Kind.SUITE, str(self.suite), SuiteSpec)
            .facts(str(self.level), self.index, seed)
        )

    @property
    def item(self) -> str:
        """The recording's path, or its number in the level."""
        return str(self.path) if self.path is not None else f"{self.index:06d}"


def execute(task: Task, options: Options) -> tuple[list[Estimate], Evidence | None]:
    """Run one task, the unit of parallel work; a recording from disk is examined too, for the report."""
    specs = [registry.load().get(Kind.SOLVER, name, SolverSpec) for name in task.solvers]
    recording = task.recording(options.seed)
    ready = prepare(recording)
    prepared = segmented(ready, options.segmenter)
    facts = task.facts(options.seed)
    origin = provenance(recording, options) | ({"facts": dict(facts)} if facts else {})
    estimates = [
        replace(estimate, suite=task.suite or "files", level=task.level, item=task.item)
        for estimate in each_solved(prepared, specs, options, origin)
    ]
    if task.path is None:
        return estimates, None
    return estimates, evidence_from(recording, ready, diagnose.check(recording, ready))


def remaining(tasks: Iterable[Task], done: set[store.Key], options: Options) -> list[Task]:
    """The tasks without the solvers that already have a result of the same place, content, seed and masks."""
    finished = {key[:3] + key[4:] for key in done}
    contents = {key[3] for key in done}

    def missing(task: Task) -> tuple[str, ...]:
        place = task.suite or "files", task.level, task.item
        if task.path is not None and contents and load_recording(task.path).sha256 not in contents:
            return task.solvers
        return tuple(s for s in task.solvers if (*place, s, options.seed, options.segmenter) not in finished)

    pairs = ((task, missing(task)) for task in tasks)
    return [
        task if solvers == task.solvers else replace(task, solvers=solvers)
        for task, solvers in pairs
        if solvers
    ]


def run(
    tasks: Sequence[Task],
    options: Options,
    *,
    out: Path,
    jobs: int = 1,
    executor: str | None = None,
    resume: bool = False,
    on_result: Callable[[list[Estimate]], None] = lambda estimates: None,
) -> store.Contents:
    """Run the tasks into a store; what is finished is on disk at once, so an interrupted run goes on with
    `resume`.

    Raises:
        InputError: a recording cannot be read, or the store is in use or not empty.
        HecbenchError: the store cannot be written.
    """
    with store.writing(out, resume=resume) as writer:
        done = store.keys(out)
        for estimates, found in _executed(remaining(tasks, done, options), options, jobs, executor):
            if found is not None:
                evidence.save(found, out)
            writer.append(estimates)
            on_result(estimates)
    return store.read(out)


def _executed(
    tasks: Sequence[Task], options: Options, jobs: int, executor: str | None
) -> Iterator[tuple[list[Estimate], Evidence | None]]:
    """The results as they come: here, in worker processes, or on a cluster."""
    if executor is None and (jobs == 1 or len(tasks) < 2):
        yield from (execute(task, options) for task in tasks)
        return
    running = (
        pool.on_this_machine(_execute_alone, tasks, (options,), jobs)
        if executor is None
        else pool.on_cluster(_execute_alone, tasks, (options,), executor)
    )
    for task, result in running:
        yield (_lost(task, options, str(result)), None) if isinstance(result, Ended) else result


def _execute_alone(task: Task, options: Options) -> tuple[list[Estimate], Evidence | None]:
    """One of several worker processes, which have the cores between them: a thread each."""
    threads.limit(1)
    return execute(task, options)


def _lost(task: Task, options: Options, reason: str) -> list[Estimate]:
    """The results of a task whose process died."""
    ended = Estimate(
        status=Status.FAILED,
        reason=reason,
        termination=Termination.STALLED,
        recording=task.item,
        suite=task.suite or "files",
        level=task.level,
        item=task.item,
        provenance={"seed": options.seed, "masks": options.segmenter, "command": options.command},
    )
    return [replace(ended, solver=solver) for solver in task.solvers]
