"""Plan = recordings x solvers -> estimates with their errors, one recording after the other or in parallel."""

from __future__ import annotations

import sys
import traceback
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from hecbench import __version__, diagnose, evidence, registry, store
from hecbench.errors import InputError, Refusal, SolverFailure
from hecbench.estimate import Estimate, Status, Termination
from hecbench.evidence import Evidence
from hecbench.recording import Recording
from hecbench.robot import flange_poses
from hecbench.specs import (
    DatasetSpec,
    EvaluatorSpec,
    Into,
    Kind,
    Need,
    ObserverSpec,
    SegmenterSpec,
    SolverSpec,
    SuiteSpec,
)

_OBSERVED = (Need.CORNERS, Need.TARGET_POSES)
_HOW_TO_GIVE = {
    Need.TARGET_POSES: "samples[].camera_T_target, or corners_px with target and camera.K",
    Need.CORNERS: "samples[].corners_px",
    Need.INTRINSICS: "camera.K",
    Need.IMAGES: "samples[].image",
    Need.MASKS: "samples[].mask",
    Need.JOINTS: "samples[].joints_rad",
    Need.ROBOT_MODEL: "robot.model or robot.urdf",
    Need.INITIAL: "initial_parent_T_camera",
}


@dataclass(frozen=True)
class Options:
    """What holds for a whole run.

    Attributes:
        seed: of every random choice.
        held_out: whether to refit on folds; None: only without truth, and not for slow solvers.
        command: the command line, for the provenance.
        segmenter: whose masks the solvers get; None: the recording's own, where it has some.
        stop_on_bad_input: raise when a solver finds a damaged image, instead of reporting it as a failure.
    """

    seed: int = 0
    held_out: bool | None = None
    command: str = ""
    segmenter: str | None = None
    stop_on_bad_input: bool = True


def load_recording(path: Path) -> Recording:
    """Read a recording of any format whose adapter recognises it.

    Raises:
        InputError: nothing there, no adapter or several recognise it, or the adapter finds a fault.
    """
    adapters = registry.load().ready(Kind.DATASET, DatasetSpec)
    recognised = [adapter for adapter in adapters if adapter.sniff(path)]
    found = [adapter for adapter in recognised if not adapter.last_resort] or recognised
    if not found and not path.exists():
        raise InputError(f"{path}: does not exist; give a recording's folder")
    if not found:
        known = "; ".join(f"{adapter.name}: {adapter.summary}" for adapter in adapters)
        raise InputError(f"{path}: is no known recording. Known are {known}")
    if len(found) > 1:
        names = ", ".join(adapter.name for adapter in found)
        raise InputError(f"{path}: could be {names}; name one with `hecbench import --format`")
    return found[0].load(path)


def prepare(recording: Recording) -> Recording:
    """Compute what is not given: robot poses from joints, corners from images, target poses from corners.

    Why something could not be computed joins the recording's `notes`.
    """
    recording = with_robot_poses(recording)
    for need in _OBSERVED:
        for observer in registry.load().ready(Kind.OBSERVER, ObserverSpec):
            if observer.gives is need and observer.applies(recording):
                try:
                    recording = observer.factory()(recording)
                except Refusal as refusal:
                    recording = replace(recording, notes=(*recording.notes, str(refusal)))
    return recording


def will_offer(recording: Recording, segmenter: str | None = None) -> frozenset[Need]:
    """What the recording will offer once it is prepared and has the segmenter's masks, found without either."""
    offers = recording.offers()
    if segmenter is not None:
        offers |= {Need.MASKS}
    observers = registry.load().ready(Kind.OBSERVER, ObserverSpec)
    given = {observer.gives for observer in observers if observer.applies(recording)}
    if Need.CORNERS in given:  # detection calibrates an unknown camera
        given |= {Need.INTRINSICS, Need.TARGET_POSES}
    return offers | given


def with_robot_poses(recording: Recording) -> Recording:
    """Fill a missing base_T_flange from the joints by the robot model's forward kinematics, where both are
    known.
    """
    robot, joints_rad = recording.robot, recording.joints_rad
    lacks_all = recording.base_T_flange is None
    if not lacks_all or joints_rad is None or robot is None or not (robot.model or robot.urdf):
        return recording
    return replace(recording, base_T_flange=flange_poses(robot, joints_rad))


def solve(
    recording: Recording,
    specs: Iterable[SolverSpec],
    options: Options = Options(),
    *,
    say: Callable[[str], None] = lambda note: None,
) -> list[Estimate]:
    """One estimate of each solver, in the order given, with errors and held-out residuals.

    `say` gets each note about how the recording was read and what was computed from it.
    """
    prepared = segmented(prepare(recording), options.segmenter)
    for note in prepared.recording.notes:
        say(note)
    return _solve_prepared(prepared, specs, options, _provenance(recording, options))


@dataclass(frozen=True)
class Segmented:
    """A recording with the masks of a segmenter.

    Attributes:
        recording: with these masks; without any when the segmenter refused.
        refusal: why it did, or which image it could not read.
        given_iou: mean intersection over union with the recording's own masks, where it has some.
    """

    recording: Recording
    refusal: str | None = None
    given_iou: float | None = None


def segmented(recording: Recording, name: str | None) -> Segmented:
    """Let a segmenter, which does not see the truth, make the masks; None leaves them as they are."""
    if name is None:
        return Segmented(recording)
    segmenter = registry.load().get(Kind.SEGMENTER, name, SegmenterSpec)
    try:
        found = segmenter.factory()(recording.without_truth())
    except (Refusal, InputError) as reason:
        return Segmented(replace(recording, masks=None), f"segmenter '{name}': {reason}")
    masked = replace(recording, masks=found.masks, notes=found.notes)
    return Segmented(masked, given_iou=_mean_iou(masked, recording))


def _mean_iou(recording: Recording, other: Recording) -> float | None:
    """Of the masks that both have."""
    pairs = zip(recording.masks or (), other.masks or (), strict=False)
    both = [i for i, (mask, mask_of_other) in enumerate(pairs) if not (mask is None or mask_of_other is None)]
    values = []
    for i in both:
        mask, mask_of_other = recording.mask(i), other.mask(i)
        values.append((mask & mask_of_other).sum() / max((mask | mask_of_other).sum(), 1))
    return float(np.mean(values)) if values else None


def _solve_prepared(
    prepared: Segmented, specs: Iterable[SolverSpec], options: Options, origin: dict[str, Any]
) -> list[Estimate]:
    recording, blind = prepared.recording, prepared.recording.without_truth()
    estimates = []
    for spec in specs:
        if prepared.refusal is not None and Need.ROBOT_MODEL in spec.needs:
            estimate = _unanswered(blind, spec, Status.REFUSED, prepared.refusal, 0.0)
        else:
            solved = _solve_blind(blind, spec, options)
            estimate = _measured(solved, recording, blind, spec, options)
        if prepared.given_iou is not None:
            told = {**estimate.diagnostics, "masks_iou_given": prepared.given_iou}
            estimate = replace(estimate, diagnostics=told)
        estimates.append(replace(estimate, provenance=origin))
    return estimates


def _provenance(recording: Recording, options: Options) -> dict[str, Any]:
    return {
        "hecbench": __version__,
        "recording_sha256": recording.sha256,
        "seed": options.seed,
        "masks": options.segmenter,
        "command": options.command,
        "versions": _versions(),
    } | {
        name: pose.tolist()
        for name in ("initial_parent_T_camera", "truth_parent_T_camera")
        if (pose := getattr(recording, name)) is not None
    }


def _solve_blind(blind: Recording, spec: SolverSpec, options: Options) -> Estimate:
    """Run one solver and turn every way it can end into an estimate."""
    missing = [need for need in Need if need in spec.needs - blind.offers()]
    if missing:
        wanted = "; ".join(f"{need} ({_HOW_TO_GIVE[need]})" for need in missing)
        reason = "; ".join([f"the recording lacks {wanted}", *blind.notes])
        return _unanswered(blind, spec, Status.REFUSED, reason, 0.0)
    solver = spec.factory()
    rng = np.random.default_rng([options.seed, zlib.crc32(spec.name.encode())])
    start = perf_counter()
    try:
        estimate = solver(blind, rng=rng)
    except Refusal as refusal:
        return _unanswered(blind, spec, Status.REFUSED, str(refusal), perf_counter() - start)
    except SolverFailure as failure:
        return _unanswered(blind, spec, Status.FAILED, str(failure), perf_counter() - start)
    except InputError as error:
        if options.stop_on_bad_input:
            raise
        return _unanswered(blind, spec, Status.FAILED, str(error), perf_counter() - start)
    except Exception as error:
        reason = f"crashed with {type(error).__name__}: {error} ({_place(error)})"
        return _unanswered(blind, spec, Status.FAILED, reason, perf_counter() - start)
    return _labelled(estimate, blind, spec, perf_counter() - start)


def _place(error: BaseException) -> str:
    frame = traceback.extract_tb(error.__traceback__)[-1]
    return f"{Path(frame.filename).name}:{frame.lineno}"


def _unanswered(blind: Recording, spec: SolverSpec, status: Status, reason: str, seconds: float) -> Estimate:
    ended = Termination.NOT_RUN if status is Status.REFUSED else Termination.STALLED
    return _labelled(Estimate(status=status, reason=reason, termination=ended), blind, spec, seconds)


def _labelled(estimate: Estimate, blind: Recording, spec: SolverSpec, seconds: float) -> Estimate:
    return replace(
        estimate,
        solver=spec.name,
        recording=blind.name,
        mounting=blind.mounting,
        parent_link=blind.parent_link,
        camera=estimate.camera or blind.camera,
        seconds=seconds,
    )


def _measured(
    estimate: Estimate, recording: Recording, blind: Recording, spec: SolverSpec, options: Options
) -> Estimate:
    """The estimate with what every ruler that applies says about it."""
    if estimate.status is not Status.OK:
        return estimate
    has_truth = recording.truth_parent_T_camera is not None
    wants_folds = options.held_out if options.held_out is not None else not (has_truth or spec.slow)
    wanted = {Into.ERRORS: has_truth, Into.HELD_OUT: wants_folds, Into.DIAGNOSTICS: True}
    measured: dict[Into, dict[str, Any]] = {part: {} for part in Into}
    for evaluator in registry.load().ready(Kind.EVALUATOR, EvaluatorSpec):
        if wanted[evaluator.into] and evaluator.applies(recording):
            measured[evaluator.into] |= evaluator.factory()(
                estimate,
                recording if evaluator.into is Into.ERRORS else blind,
                solve=lambda part: _solve_blind(part, spec, options),
                rng=np.random.default_rng([options.seed, zlib.crc32(evaluator.name.encode())]),
            )
    return replace(
        estimate,
        errors=measured[Into.ERRORS] or None,
        held_out=measured[Into.HELD_OUT] or None,
        diagnostics=measured[Into.DIAGNOSTICS] | dict(estimate.diagnostics),
    )


@cache
def _versions() -> dict[str, str]:
    from importlib import metadata

    python = f"{sys.version_info.major}.{sys.version_info.minor}.{sys.version_info.micro}"
    names = ("numpy", "scipy", "numba", "opencv-contrib-python-headless")
    return {"python": python} | {name: metadata.version(name) for name in names}


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
    prepared = segmented(prepare(recording), options.segmenter)
    facts = task.facts(options.seed)
    origin = _provenance(recording, options) | ({"facts": dict(facts)} if facts else {})
    estimates = [
        replace(estimate, suite=task.suite or "files", level=task.level, item=task.item)
        for estimate in _solve_prepared(prepared, specs, options, origin)
    ]
    return estimates, None if task.path is None else _examined(recording, prepared.recording)


def _examined(recording: Recording, prepared: Recording) -> Evidence:
    findings = diagnose.check(recording, prepare)
    influence = next((dict(f.per_sample) for f in findings if f.id == "influence"), {})
    influence_mm = np.array([influence.get(sample, np.nan) for sample in recording.sample_ids])
    return evidence.collect(prepared, recording.sha256, [f.to_json() for f in findings], influence_mm)


def remaining(tasks: Iterable[Task], done: Iterable[Estimate], options: Options) -> list[Task]:
    """The tasks without the solvers that already have a result of the same place, content, seed and masks."""
    finished = {store.key(estimate)[:3] + store.key(estimate)[4:] for estimate in done}
    contents = {store.key(estimate)[3] for estimate in done}

    def missing(task: Task) -> tuple[str, ...]:
        place = task.suite or "files", task.level, task.item
        if task.path is not None and contents and load_recording(task.path).sha256 not in contents:
            return task.solvers
        return tuple(s for s in task.solvers if (*place, s, options.seed, options.segmenter) not in finished)

    pruned = (replace(task, solvers=missing(task)) for task in tasks)
    return [task for task in pruned if task.solvers]


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
        done = store.read(out).estimates
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
    from joblib import Parallel, delayed

    with _backend(executor):
        parallel = Parallel(n_jobs=jobs if executor is None else -1, return_as="generator_unordered")
        yield from parallel(delayed(execute)(task, options) for task in tasks)


@contextmanager
def _backend(executor: str | None) -> Iterator[None]:
    """joblib's own processes, or the workers of the dask scheduler at a URL."""
    if executor is None:
        yield
        return
    from joblib import parallel_config

    try:
        from distributed import Client

        client = Client(executor, timeout="5s", set_as_default=False)
    except ImportError:
        raise InputError("--executor needs dask: pip install 'hecbench[cluster]'") from None
    except (OSError, ValueError, TypeError) as error:
        raise InputError(
            f"--executor {executor}: no scheduler answers ({error}); give its tcp://host:port"
        ) from error
    with client, parallel_config(backend="dask", client=client):
        yield
