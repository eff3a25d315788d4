"""One recording and some solvers -> estimates with their errors, whatever way each solver ends."""

from __future__ import annotations

import sys
import traceback
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from importlib import metadata
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from hecbench import __version__, lens, registry
from hecbench.errors import InputError, InvalidAnswer, Refusal, SolverFailure
from hecbench.estimate import Estimate, Status, Termination
from hecbench.preparation import Segmented, prepare, segmented
from hecbench.recording import Recording
from hecbench.running import isolation
from hecbench.specs import EvaluatorSpec, Kind, Need, ResultSection, SolverSpec

_HOW_TO_GIVE = {
    Need.TARGET_POSES: "samples[].camera_T_target, or corners_px with target and camera.K",
    Need.CORNERS: "samples[].corners_px",
    Need.INTRINSICS: "camera.K",
    Need.IMAGES: "samples[].image",
    Need.MASKS: "samples[].mask",
    Need.DEPTH: "samples[].depth",
    Need.JOINTS: "samples[].joints_rad",
    Need.ROBOT_MODEL: "robot.model or robot.urdf",
    Need.INITIAL: "initial_parent_T_camera",
}


_OF_TARGET = frozenset({Need.TARGET_POSES, Need.CORNERS})


@dataclass(frozen=True)
class Options:
    """What holds for a whole run.

    Attributes:
        seed: of every random choice.
        held_out: whether to solve again on folds; None: only without truth, and not by slow solvers. A slow solver
            that does not look at the target then predicts the target with its one answer.
        command: the command line, for the provenance.
        segmenter: whose masks the solvers get; None: the recording's own, where it has some.
        stop_on_bad_input: raise when a solver finds a damaged image, instead of reporting it as a failure.
        timeout_s: for each call of a solver, in a process of its own; None: as long as it takes.
        memory_mb: of data, for each call of a solver, in a process of its own; None: as much as there is.
    """

    seed: int = 0
    held_out: bool | None = None
    command: str = ""
    segmenter: str | None = None
    stop_on_bad_input: bool = True
    timeout_s: float | None = None
    memory_mb: int | None = None


def solve(
    recording: Recording,
    specs: Iterable[SolverSpec],
    options: Options = Options(),
) -> list[Estimate]:
    """One estimate of each solver, in the order given, with errors and held-out residuals."""
    prepared = segmented(prepare(recording), options.segmenter)
    return list(each_solved(prepared, specs, options, provenance(recording, options)))


def each_solved(
    prepared: Segmented,
    specs: Iterable[SolverSpec],
    options: Options,
    origin: dict[str, Any],
    on_start: Callable[[SolverSpec], None] = lambda spec: None,
) -> Iterator[Estimate]:
    """The estimates of a prepared recording as they come; `on_start` is called before each solver."""
    recording, blind = prepared.recording, prepared.recording.without_truth()
    for spec in specs:
        on_start(spec)
        if prepared.refusal is not None and Need.ROBOT_MODEL in spec.needs:
            estimate = _unanswered(blind, spec, Status.REFUSED, prepared.refusal)
        else:
            with _caller(spec, options) as solve_part:
                estimate = _measured(solve_part(blind), recording, blind, spec, options, solve_part)
        if prepared.given_iou is not None:
            diagnostics = {**estimate.diagnostics, "masks_iou_given": prepared.given_iou}
            estimate = replace(estimate, diagnostics=diagnostics)
        yield replace(estimate, provenance=origin)


def provenance(recording: Recording, options: Options) -> dict[str, Any]:
    return {
        "hecbench": __version__,
        "recording_sha256": recording.sha256,
        "seed": options.seed,
        "masks": options.segmenter,
        "command": options.command,
        "versions": versions(),
    } | {
        name: pose.tolist()
        for name in ("initial_parent_T_camera", "truth_parent_T_camera")
        if (pose := getattr(recording, name)) is not None
    }


@contextmanager
def _caller(spec: SolverSpec, options: Options) -> Iterator[Callable[[Recording], Estimate]]:
    """The function that runs a solver: in a process of its own when it is a stranger's, or has a limit."""
    limited = options.timeout_s is not None or options.memory_mb is not None
    if not limited and not registry.load().is_foreign(spec.name):

        def here(part: Recording) -> Estimate:
            with isolation.stdout_to_stderr():
                return _solve_blind(part, spec, options)

        yield here
        return
    with isolation.Worker(options.timeout_s, options.memory_mb) as worker:

        def elsewhere(part: Recording) -> Estimate:
            start = perf_counter()
            try:
                return worker.call(_solve_named, part, spec.name, options)  # type: ignore[no-any-return]
            except isolation.TookTooLong as reason:
                status, text = Status.TIMEOUT, f"{reason}; give it more with --timeout"
            except isolation.Ended as reason:
                status, text = Status.FAILED, str(reason)
            return _unanswered(part, spec, status, text, perf_counter() - start)

        yield elsewhere


def _solve_named(blind: Recording, name: str, options: Options) -> Estimate:
    return _solve_blind(blind, registry.load().get(Kind.SOLVER, name, SolverSpec), options)


def _solve_blind(blind: Recording, spec: SolverSpec, options: Options) -> Estimate:
    """Run one solver and turn every way it can end into an estimate."""
    missing = [need for need in Need if need in spec.needs - blind.offers()]
    if missing:
        wanted = "; ".join(f"{need} ({_HOW_TO_GIVE[need]})" for need in missing)
        reason = "; ".join([f"the recording lacks {wanted}", *blind.notes])
        return _unanswered(blind, spec, Status.REFUSED, reason)
    rng = np.random.default_rng([options.seed, zlib.crc32(spec.name.encode())])
    start = perf_counter()

    def unanswered(status: Status, reason: str) -> Estimate:
        return _unanswered(blind, spec, status, reason, perf_counter() - start)

    try:
        solver = spec.factory()
        start = perf_counter()
        estimate = solver(blind, rng=rng)
        if not isinstance(estimate, Estimate):
            return unanswered(Status.FAILED, f"returned a {type(estimate).__name__}, not an Estimate")
        return _labelled(estimate, blind, spec, perf_counter() - start)
    except Refusal as refusal:
        return unanswered(Status.REFUSED, str(refusal))
    except SolverFailure as failure:
        return unanswered(Status.FAILED, str(failure))
    except InvalidAnswer as error:
        return unanswered(Status.FAILED, f"gave no valid answer: {error}")
    except InputError as error:
        if options.stop_on_bad_input:
            raise
        return unanswered(Status.FAILED, str(error))
    except Exception as error:
        return unanswered(Status.FAILED, f"crashed with {type(error).__name__}: {error} ({_place(error)})")


def _place(error: BaseException) -> str:
    frame = traceback.extract_tb(error.__traceback__)[-1]
    return f"{Path(frame.filename).name}:{frame.lineno}"


def _unanswered(
    blind: Recording, spec: SolverSpec, status: Status, reason: str, seconds: float = 0.0
) -> Estimate:
    ended = Termination.NOT_RUN if status is Status.REFUSED else Termination.STALLED
    return _labelled(Estimate(status=status, reason=reason, termination=ended), blind, spec, seconds)


def _labelled(estimate: Estimate, blind: Recording, spec: SolverSpec, seconds: float) -> Estimate:
    own, given = estimate.camera, blind.camera
    if own is not None and given is not None and not lens.same(own, given):
        estimate = replace(estimate, diagnostics={**estimate.diagnostics, "camera_changed": True})
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
    estimate: Estimate,
    recording: Recording,
    blind: Recording,
    spec: SolverSpec,
    options: Options,
    solve_part: Callable[[Recording], Estimate],
) -> Estimate:
    """The estimate with what every evaluator that applies says about it."""
    if estimate.status is not Status.OK:
        return estimate
    has_truth = recording.truth_parent_T_camera is not None
    wants_folds = options.held_out if options.held_out is not None else not has_truth
    if spec.slow and options.held_out is None:
        # What it looked at leaves no trace in the target: the answer on all samples predicts it as one on folds would.
        wants_folds = wants_folds and blind.camera_T_target is not None and not spec.needs & _OF_TARGET
        solve_part = lambda part: estimate  # noqa: E731
    wanted = {
        ResultSection.ERRORS: has_truth,
        ResultSection.HELD_OUT: wants_folds,
        ResultSection.DIAGNOSTICS: True,
    }
    measured: dict[ResultSection, dict[str, Any]] = {part: {} for part in ResultSection}
    for evaluator in registry.load().ready(Kind.EVALUATOR, EvaluatorSpec):
        if wanted[evaluator.into] and evaluator.applies(recording):
            seen = recording if evaluator.into is ResultSection.ERRORS else blind
            rng = np.random.default_rng([options.seed, zlib.crc32(evaluator.name.encode())])
            try:
                found = evaluator.factory()(estimate, seen, solve=solve_part, rng=rng)
                measured[evaluator.into] |= found
            except (InputError, ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
                if isinstance(error, InputError) and options.stop_on_bad_input:
                    raise
                failure = {f"{evaluator.name}_failed": f"{type(error).__name__}: {error} ({_place(error)})"}
                measured[ResultSection.DIAGNOSTICS] |= failure
    return replace(
        estimate,
        errors=measured[ResultSection.ERRORS] or None,
        held_out=measured[ResultSection.HELD_OUT] or None,
        diagnostics=measured[ResultSection.DIAGNOSTICS] | dict(estimate.diagnostics),
    )


@cache
def versions() -> dict[str, str]:
    """Of Python and of the libraries on which numbers depend."""
    python = f"{sys.version_info.major}.{sys.version_info.minor}.{sys.version_info.micro}"
    names = ("numpy", "scipy", "numba", "opencv-contrib-python-headless")
    return {"python": python} | {name: metadata.version(name) for name in names}
