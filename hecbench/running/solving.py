"""One recording and some solvers -> estimates with their errors, whatever way each solver ends."""

from __future__ import annotations

import sys
import traceback
import zlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cache
from importlib import metadata
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from hecbench import __version__, registry
from hecbench.errors import InputError, Refusal, SolverFailure
from hecbench.estimate import Estimate, Status, Termination
from hecbench.preparation import Segmented, prepare, segmented
from hecbench.recording import Recording
from hecbench.specs import EvaluatorSpec, Kind, Need, ResultSection, SolverSpec

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
    return solve_prepared(prepared, specs, options, provenance(recording, options))


def solve_prepared(
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


def provenance(recording: Recording, options: Options) -> dict[str, Any]:
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
    wanted = {
        ResultSection.ERRORS: has_truth,
        ResultSection.HELD_OUT: wants_folds,
        ResultSection.DIAGNOSTICS: True,
    }
    measured: dict[ResultSection, dict[str, Any]] = {part: {} for part in ResultSection}
    for evaluator in registry.load().ready(Kind.EVALUATOR, EvaluatorSpec):
        if wanted[evaluator.into] and evaluator.applies(recording):
            measured[evaluator.into] |= evaluator.factory()(
                estimate,
                recording if evaluator.into is ResultSection.ERRORS else blind,
                solve=lambda part: _solve_blind(part, spec, options),
                rng=np.random.default_rng([options.seed, zlib.crc32(evaluator.name.encode())]),
            )
    return replace(
        estimate,
        errors=measured[ResultSection.ERRORS] or None,
        held_out=measured[ResultSection.HELD_OUT] or None,
        diagnostics=measured[ResultSection.DIAGNOSTICS] | dict(estimate.diagnostics),
    )


@cache
def _versions() -> dict[str, str]:
    python = f"{sys.version_info.major}.{sys.version_info.minor}.{sys.version_info.micro}"
    names = ("numpy", "scipy", "numba", "opencv-contrib-python-headless")
    return {"python": python} | {name: metadata.version(name) for name in names}
