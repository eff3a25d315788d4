"""A recording made ready: read, robot poses from joints, corners from images, target poses, masks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hecbench import registry
from hecbench.errors import InputError, Refusal
from hecbench.recording import ImageSource, Recording
from hecbench.robots.posed import PosedRobot
from hecbench.specs import DatasetSpec, Kind, Need, ObserverSpec, SegmenterSpec
from hecbench.system import threads

_OBSERVED = (Need.CORNERS, Need.TARGET_POSES)


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
    """Fill a missing base_T_flange by forward kinematics, where joints and a robot model are known."""
    robot = recording.robot
    if (
        recording.base_T_flange is not None
        or recording.joints_rad is None
        or robot is None
        or not robot.source
    ):
        return recording
    return replace(recording, base_T_flange=PosedRobot.of(recording, meshes=False).base_T_flange)


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


def readable(recording: Recording) -> Recording:
    """Without the pictures that cannot be read: each costs its sample, and joins the notes, instead of its recording.

    They are only decoded where a method may look at them: with joints and a robot model.
    """
    if not {Need.JOINTS, Need.ROBOT_MODEL} <= recording.offers():
        return recording
    changes: dict[str, Any] = {}
    faults: list[str] = []
    for name, decode in (("images", recording.image), ("masks", recording.mask)):
        sources: tuple[ImageSource, ...] = getattr(recording, name) or ()
        given = [i for i, source in enumerate(sources) if source is not None]
        found = dict(zip(given, threads.each(partial(_fault, decode), given), strict=True))
        if any(found.values()):
            changes[name] = tuple(None if found.get(i) else source for i, source in enumerate(sources))
            faults += [f"left out: {fault}" for fault in found.values() if fault]
    return replace(recording, **changes, notes=(*recording.notes, *faults)) if faults else recording


def _fault(decode: Callable[[int], object], index: int) -> str | None:
    """Why a picture cannot be decoded, or None."""
    try:
        decode(index)
    except InputError as error:
        return str(error)
    return None


def segmented(recording: Recording, name: str | None) -> Segmented:
    """Let a segmenter, which does not see the truth, make the masks; None leaves them as they are.

    Pictures that cannot be read are left out first.
    """
    recording = readable(recording)
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
