"""Why the answer is believed, why others disagree, what would make it better: sentences from numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from hecbench import se3
from hecbench.estimate import Metric
from hecbench.recording import CameraModel, Recording
from hecbench.system.wording import significant
from hecbench.verdict import camera as cameras
from hecbench.verdict.answers import TARGET_POSES, Answer
from hecbench.verdict.result import Expected

_LOOKS_AT = {True: "the target", False: "the robot itself"}
_MOST_SAMPLES = 60


def reasons(
    best: Answer,
    near: Sequence[Answer],
    confirmed: Sequence[Answer],
    doubts: Sequence[str],
    recording: Recording,
    apart_mm: Callable[[Answer], float],
) -> list[str]:
    """What was looked at, and what confirms or contradicts the answer."""
    said = [_looked_at(recording)]
    if confirmed:
        other = confirmed[0]
        said.append(
            f"{other.solver}, which looks at {_LOOKS_AT[other.sees_target]} and not at {_LOOKS_AT[best.sees_target]},"
            f" agrees within {significant(apart_mm(other))} mm"
        )
    if near:
        kin = [answer for answer in near if answer not in confirmed]
        if kin:
            said.append(
                f"{len(kin)} methods on the same evidence agree, the nearest is {kin[0].solver} at"
                f" {significant(apart_mm(kin[0]))} mm"
                if len(kin) > 1
                else f"{kin[0].solver}, on the same evidence, agrees within {significant(apart_mm(kin[0]))} mm"
            )
    elif not doubts:
        said.append("no other method confirms it")
    said += doubts
    if doubtful := best.estimate.diagnostics.get("doubtful_samples"):
        said.append(f"samples that disagree with the others: {', '.join(map(str, doubtful))}")
    return said


def _looked_at(recording: Recording) -> str:
    count = f"{len(recording)} samples"
    if recording.base_T_flange is None:
        return count
    poses = recording.base_T_flange[np.isfinite(recording.base_T_flange).all((1, 2))]
    middle = se3.mean(poses)
    turned = np.rad2deg(se3.rotation_error_rad(middle, poses)).max()
    extent = 1e3 * np.ptp(poses[:, :3, 3], axis=0)
    return (
        f"{count}; the hand turns by up to {turned:.0f} deg from its mean and moves by {extent.max():.0f} mm"
    )


def why_apart(
    answer: Answer,
    best: Answer,
    near: Sequence[Answer],
    metric: Metric | None,
    camera: CameraModel | None,
    findings: Sequence[dict[str, Any]],
) -> str:
    """Why a method disagrees, from what is known about both."""
    if answer.moved_camera and not best.moved_camera:
        why = cameras.moved(answer, camera)
        return why + ("" if cameras.determined(answer) else ", which the samples do not determine")
    if best.moved_camera and not answer.moved_camera:
        return f"it keeps the recording's camera; {best.solver} {cameras.moved(best, camera)}"
    if answer.sees_target not in {each.sees_target for each in (best, *near)}:
        return f"it looks at {_LOOKS_AT[answer.sees_target]}: the models of target, robot and lens do not fit together"
    suspects = [f for f in findings if f["severity"] in ("critical", "warning")]
    mine, theirs = (None if metric is None else metric.of(a.estimate) for a in (best, answer))
    if (
        metric is not None
        and mine is not None
        and theirs is not None
        and (mine < theirs) == metric.smaller_is_better
    ):
        text = f"{metric.label}: {significant(theirs, 3)} against {significant(mine, 3)}"
        if answer.evidence == TARGET_POSES and best.evidence != TARGET_POSES:
            text += "; it weighs single-view target poses alike, near or far, tilted or not"
        return text
    if suspects:
        return f"see the finding {suspects[0]['id']}: {suspects[0]['summary']}"
    if np.isfinite(answer.rms_m) and answer.rms_m > best.rms_m:
        return f"its own expected error is {significant(1e3 * answer.rms_m)} mm"
    return "not known"


def what_next(
    findings: Sequence[dict[str, Any]],
    expected: Expected | None,
    tolerance_mm: float,
    suspicion: str | None,
    samples: int,
) -> list[str]:
    """What the user can do, the most urgent first."""
    order = {"critical": 0, "warning": 1}
    urgent = sorted((f for f in findings if f["severity"] in order), key=lambda f: order[f["severity"]])
    said = [f"{f['id']}: {f['action'] or f['summary']}" for f in urgent]
    if suspicion:
        said.append("calibrate the lens again, with the target over the whole image")
    if expected is not None and expected.high > tolerance_mm:
        needed = int(np.ceil(samples * (expected.high / tolerance_mm) ** 2))
        if needed <= _MOST_SAMPLES:
            said.append(f"record about {needed} samples in place of {samples}, as varied as these")
    said += [f["summary"] for f in findings if f["id"] == "next_pose"]
    return said
