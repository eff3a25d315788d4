"""The checks of plugins that are no solvers: segmenters, translators, adapters, exporters, evaluators."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from hecbench.conformance.photographs import photographs
from hecbench.conformance.solvers import global_states, rig
from hecbench.errors import HecbenchError
from hecbench.estimate import Estimate
from hecbench.recording import Mounting, Recording
from hecbench.specs import DatasetSpec, EvaluatorSpec, ExporterSpec, SegmenterSpec, TranslatorSpec

_LEAST_IOU = 0.3
"""Of the masks that are not empty, on average; less is no mask of the robot."""


def segments(spec: SegmenterSpec) -> Iterator[str]:
    """Masks of the robot, one per sample, or a refusal; the pictures and the truth are left alone."""
    recording = photographs()
    digest = recording.sha256
    try:
        found = spec.factory()(recording.without_truth())
    except HecbenchError as refusal:
        if not str(refusal):
            yield "refused without a reason"
        return
    if replace(recording).sha256 != digest:
        yield "the recording was changed; return a copy with masks"
    if found.masks is None or any(mask is None for mask in found.masks):
        yield "a sample has no mask; where no robot is seen give one of zeros"
        return
    overlaps = []
    for sample in range(len(recording)):
        mask, truth = found.mask(sample), recording.mask(sample)
        if mask.any():
            overlaps.append((mask & truth).sum() / (mask | truth).sum())
    if overlaps and np.mean(overlaps) < _LEAST_IOU:
        yield f"the masks overlap with the robot by {np.mean(overlaps):.2f} only, on average"


def translates(spec: TranslatorSpec) -> Iterator[str]:
    """A picture of the same size in [0, 1], finite, black outside the mask; the input is left alone."""
    recording = photographs()
    image = np.asarray(recording.image(0) / 255, np.float32)
    mask = recording.mask(0).astype(np.float32)
    before = image.copy()
    part = np.where(mask > 0, 0, -1).astype(np.int32)
    found = spec.factory()(image, mask, part=part, colours=np.full((8, 3), 0.5))
    if found.shape != image.shape:
        yield f"gave a picture of shape {found.shape} for one of {image.shape}"
        return
    if not (np.isfinite(found).all() and found.min() >= 0 and found.max() <= 1):
        yield "gave values that are not in [0, 1]"
    if found[mask == 0].max(initial=0) > 0:
        yield "is not black outside the mask"
    if not np.array_equal(image, before):
        yield "changed the picture that it was given"


def reads(spec: DatasetSpec) -> Iterator[str]:
    """Folders that are not of the format are not recognised, and `load` names them in one line."""
    with tempfile.TemporaryDirectory() as name:
        empty, strange = Path(name) / "empty", Path(name) / "strange"
        empty.mkdir()
        strange.mkdir()
        (strange / "notes.txt").write_bytes(bytes(range(256)))
        for path in (empty, strange, strange / "notes.txt", Path(name) / "absent"):
            if spec.sniff(path) and not (spec.last_resort and path.exists()):
                yield f"recognises {path.name}, which is not of its format"
            try:
                spec.load(path)
            except HecbenchError as error:
                if path.name not in str(error):
                    yield f"the message for {path.name} does not name the path: {error}"
            else:
                yield f"loads {path.name}, which is not of its format"


def exports(spec: ExporterSpec) -> Iterator[str]:
    """Text for an answer in both mountings; a `HecbenchError` where there is no answer."""
    for mounting in Mounting:
        recording = rig(np.random.default_rng(0), mounting)
        answer = replace(
            Estimate(recording.truth_parent_T_camera),
            solver="exact",
            recording=recording.name,
            mounting=mounting,
            parent_link=recording.parent_link,
            camera=recording.camera,
        )
        text = spec.write(answer, {"marker": "target", "other_link": "flange"})
        if not text.strip():
            yield f"{mounting}: wrote nothing"
        if "nan" in text.lower().split():
            yield f"{mounting}: wrote nan"


def evaluates(spec: EvaluatorSpec) -> Iterator[str]:
    """Finite numbers by name for an exact answer, the same twice; the estimate and the recording are left alone."""
    recordings = [
        recording
        for recording in (rig(np.random.default_rng(0), Mounting.EYE_TO_HAND), photographs())
        if spec.applies(recording)
    ]
    if not recordings:
        return
    states = global_states()
    for recording in recordings:
        digest = recording.sha256
        first, second = (_numbers(spec, recording) for _ in range(2))
        for name in first:
            if np.isnan(first[name]):
                yield f"{recording.name}: {name} is not a number"
        if first != second:
            yield f"{recording.name}: gave other numbers the second time"
        if replace(recording).sha256 != digest:
            yield "the recording was changed"
    if global_states() != states:
        yield "a global random generator was used; use the one that is passed"


def _numbers(spec: EvaluatorSpec, recording: Recording) -> dict[str, float]:
    """What it gives for the exact answer, the numbers among it."""
    exact = replace(
        Estimate(recording.truth_parent_T_camera),
        recording=recording.name,
        mounting=recording.mounting,
        camera=recording.camera,
    )
    evaluator = spec.factory()
    found = evaluator(exact, recording, solve=lambda part: exact, rng=np.random.default_rng(0))
    return {name: float(value) for name, value in found.items() if isinstance(value, (int, float, np.number))}
