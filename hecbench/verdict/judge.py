"""From all answers on a recording and the findings of `check` to one verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hecbench.estimate import Estimate, best_first, ordering_metric
from hecbench.recording import CameraModel, Mounting, Recording
from hecbench.se3 import Array
from hecbench.verdict import camera as cameras
from hecbench.verdict import words
from hecbench.verdict.answers import Answer, agree, answers_of, distance_m, predicts_better
from hecbench.verdict.grade import graded
from hecbench.verdict.result import Agreement, Expected, Rival, Verdict
from hecbench.workspace import points_in_parent

TOLERANCE_MM = 5.0
_WORTH = 0.9
"""Of another method's rms residual on left-out samples, below which a method is better in practice."""


@dataclass(frozen=True, eq=False)
class Scales:
    """Where errors count and how large they may be: points (P, 3) m in the parent, and the user's tolerance."""

    points_m: Array
    tolerance_m: float


def judge(
    recording: Recording,
    estimates: Sequence[Estimate],
    evidence: Mapping[str, str],
    findings: Sequence[dict[str, Any]],
    *,
    tolerance_mm: float = TOLERANCE_MM,
    at_m: Array | None = None,
) -> Verdict:
    """The verdict on a prepared recording.

    Args:
        recording: with the robot poses and the camera that the solvers used.
        estimates: of its solvers.
        evidence: what each solver looks at, `answers.evidence_of`.
        findings: of `check`, as JSON.
        tolerance_mm: the error in the workspace that the user can live with.
        at_m: (3,) a place in the parent where the error is wanted too.
    """
    given = {estimate.solver: estimate for estimate in estimates}
    ordered = best_first([replace(estimate, errors=None) for estimate in estimates])
    if recording.base_T_flange is None:
        return _without_answer(recording, ordered, findings, tolerance_mm)
    moves = recording.mounting is Mounting.EYE_IN_HAND
    scales = Scales(points_in_parent(recording.base_T_flange, moves), tolerance_mm / 1e3)
    answers = answers_of(ordered, evidence, recording.camera, len(recording), scales.points_m)
    best = _recommended(answers, scales, recording.camera)
    if best is None:
        return _without_answer(recording, ordered, findings, tolerance_mm)
    near, far = _divided(best, answers, scales)
    expected, at = _expected(best, near, scales, at_m)
    suspicion = cameras.suspicion(answers, best, recording.camera)
    doubts = _doubts(best, near, far) + ([suspicion] if suspicion else [])
    confirmed = [answer for answer in near if answer.sees_target != best.sees_target]
    grade, rule = graded(
        expected, tolerance_mm, findings, doubts, is_checked=best.sees_target or bool(confirmed)
    )

    def apart_mm(answer: Answer) -> float:
        return 1e3 * distance_m(best, answer, scales.points_m)

    metric = ordering_metric(ordered)
    return Verdict(
        recording=recording.name,
        grade=grade,
        rule=rule,
        recommended=given[best.solver],
        expected=expected,
        at=at,
        tolerance_mm=tolerance_mm,
        agreement=[Agreement(a.solver, apart_mm(a), a.evidence) for a in near],
        rivals=[
            Rival(a.solver, apart_mm(a), words.why_apart(a, best, near, metric, recording.camera, findings))
            for a in far
        ],
        reasons=words.reasons(best, near, confirmed, doubts, recording, apart_mm),
        findings=findings,
        next=words.what_next(findings, expected, tolerance_mm, suspicion, len(recording)),
        estimates=[given[estimate.solver] for estimate in ordered],
    )


def _divided(best: Answer, answers: Sequence[Answer], scales: Scales) -> tuple[list[Answer], list[Answer]]:
    """The other answers, nearest first: those that agree with the best, and those that do not."""
    others = sorted(
        (answer for answer in answers if answer is not best),
        key=lambda answer: distance_m(best, answer, scales.points_m),
    )
    near = [answer for answer in others if _agree(best, answer, scales)]
    return near, [answer for answer in others if answer not in near]


def _recommended(answers: Sequence[Answer], scales: Scales, given: CameraModel | None) -> Answer | None:
    """The least expected error among methods that model their errors, unless another one predicts better.

    A method that changed the camera takes part only where that is earned. Without any method that models its errors it
    is the best predictor.
    """
    fixed = [answer for answer in answers if not answer.moved_camera] or list(answers)
    if not fixed:
        return None
    modelled = [answer for answer in fixed if answer.has_covariance()]
    best = min(modelled, key=lambda answer: answer.rms_m) if modelled else fixed[0]
    for rival in fixed:  # best predictor first
        if (
            rival.sees_target == best.sees_target
            and np.isfinite(rival.rms_m)
            and _predicts_better(rival, best)
        ):
            best = rival
            break
    for free in answers:
        if free.moved_camera and cameras.earned(free, best, given):
            return free
    return _confirmed(best, fixed, scales)


def _confirmed(best: Answer, answers: Sequence[Answer], scales: Scales) -> Answer:
    """Where a target and the robot itself were looked at and contradict the best: the nearest pair that agrees."""
    if any(a.sees_target != best.sees_target and _agree(a, best, scales) for a in answers):
        return best
    seconded = [
        a
        for a in answers
        if a.has_covariance()
        and any(b.sees_target != a.sees_target and _agree(a, b, scales) for b in answers)
    ]
    return min(seconded, key=lambda answer: answer.rms_m) if seconded else best


def _agree(first: Answer, second: Answer, scales: Scales) -> bool:
    return agree(first, second, scales.points_m, scales.tolerance_m)


def _predicts_better(first: Answer, second: Answer) -> bool:
    """Beyond chance by every number that both have, and by a tenth: of a dozen methods one is better by chance."""
    shared = []
    for name in ("reprojection_px", "target_mm"):
        one, two = ((answer.estimate.held_out or {}).get(name) for answer in (first, second))
        if one is not None and two is not None:
            if one > _WORTH * two:
                return False
            shared.append(name)
    return bool(shared) and predicts_better(first.estimate, second.estimate, shared)


def _expected(
    best: Answer, near: Sequence[Answer], scales: Scales, at_m: Array | None
) -> tuple[Expected | None, Expected | None]:
    """The expected error in the workspace and at a place, widened by what independent evidence leaves unexplained."""
    if best.uncertainty is None:
        return None, None
    others = [a for a in near if a.sees_target != best.sees_target and np.isfinite(a.rms_m)]
    unexplained_m = 0.0
    if others:
        nearest = min(others, key=lambda answer: distance_m(best, answer, scales.points_m))
        own, its = best.rms_m**2, nearest.rms_m**2
        beyond = distance_m(best, nearest, scales.points_m) ** 2 - own - its
        unexplained_m = float(np.sqrt(max(beyond, 0.0) * own / max(own + its, 1e-300)))
    expected = best.uncertainty.expected(scales.points_m, unexplained_m)
    at = None if at_m is None else best.uncertainty.expected(np.reshape(at_m, (1, 3)), unexplained_m)
    return expected, at


def _doubts(best: Answer, near: Sequence[Answer], far: Sequence[Answer]) -> list[str]:
    """What contradicts the answer: the other sensor, or a method of its own kind that models its errors."""
    doubts = []
    others = [answer for answer in (*near, *far) if answer.sees_target != best.sees_target]
    if others and not any(answer in near for answer in others):
        looked = "the robot itself" if best.sees_target else "the target"
        doubts.append(
            f"methods that look at {looked} disagree with it: {', '.join(a.solver for a in others)}"
        )
    for answer in far:
        same_kind = answer.sees_target == best.sees_target and not answer.moved_camera
        if same_kind and _predicts_better(answer, best):
            doubts.append(f"{answer.solver} lies elsewhere and predicts left-out samples better")
    return doubts


def _without_answer(
    recording: Recording, ordered: Sequence[Estimate], findings: Sequence[dict[str, Any]], tolerance_mm: float
) -> Verdict:
    grade, rule = graded(None, tolerance_mm, findings, ["no method has an answer"], is_checked=False)
    return Verdict(
        recording=recording.name,
        grade=grade,
        rule=rule,
        recommended=None,
        expected=None,
        at=None,
        tolerance_mm=tolerance_mm,
        agreement=(),
        rivals=(),
        reasons=[f"{e.solver}: {e.reason}" for e in ordered if e.reason],
        findings=findings,
        next=words.what_next(findings, None, tolerance_mm, None, len(recording)),
        estimates=ordered,
    )
