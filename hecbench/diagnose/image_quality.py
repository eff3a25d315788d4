"""Images that cannot be read, are too dark or too bright, blurred, or the same twice."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity, names
from hecbench.errors import InputError
from hecbench.recording import Recording
from hecbench.system import threads

ID = "image_quality"
LEAST_SHARPNESS = 0.1
"""Of the median sharpness of all images."""
_MOST_CLIPPED = 0.9
_DARK, _BRIGHT = 8, 247
_CURE = "look at these images; record these samples again"


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """Share of clipped pixels, sharpness around the target (mean squared Laplacian), and repeated images."""
    recording = case.recording
    indices = [i for i, source in enumerate(recording.images or ()) if source is not None]
    if not indices:
        return None, case
    faults: dict[str, list[int]] = {
        "unreadable": [],
        "dark or overexposed": [],
        "blurred": [],
        "repeated": [],
    }
    reasons: list[str] = []
    sharpness: dict[int, float] = {}
    seen: dict[bytes, int] = {}
    looks = threads.each(partial(_look, recording), indices)
    for i, look in zip(indices, looks, strict=True):
        if isinstance(look, str):
            faults["unreadable"].append(i)
            reasons.append(look)
            continue
        if look.clipped > _MOST_CLIPPED:
            faults["dark or overexposed"].append(i)
        elif look.content in seen:
            faults["repeated"] += [seen[look.content], i]
        else:
            seen[look.content] = i
        sharpness[i] = look.sharpness
    least = LEAST_SHARPNESS * float(np.median(list(sharpness.values()) or [0.0]))
    faults["blurred"] = [i for i, value in sharpness.items() if value < least]
    found = {kind: tuple(recording.sample_ids[i] for i in which) for kind, which in faults.items() if which}
    if not found:
        return Finding(ID, Severity.OK, f"{len(indices)} images are readable, exposed and sharp"), case
    summary = "; ".join(f"{kind}: {names(which)}" for kind, which in found.items())
    summary += f" ({reasons[0]})" if reasons else ""
    concerned = tuple(dict.fromkeys(sample for which in found.values() for sample in which))
    return Finding(ID, Severity.WARNING, summary, _CURE, float(len(concerned)), 0.0, concerned), case


@dataclass(frozen=True)
class _Look:
    """The larger share of pixels that are dark or overexposed, a digest of some pixels, and the sharpness."""

    clipped: float
    content: bytes
    sharpness: float


def _look(recording: Recording, index: int) -> _Look | str:
    """What one image shows, or why it cannot be read."""
    try:
        grey = _grey(recording.image(index))
    except (InputError, OSError) as error:
        return str(error)
    clipped = max((grey < _DARK).mean(), (grey > _BRIGHT).mean())
    content = hashlib.sha256(grey[::4, ::4].tobytes()).digest()
    return _Look(float(clipped), content, _sharpness(_around_target(recording, index, grey)))


def _grey(image: NDArray[np.uint8]) -> NDArray[np.float32]:
    red, green, blue = np.moveaxis(image.astype(np.float32), 2, 0)
    return np.asarray((red + green + blue) / 3)


def _around_target(recording: Recording, index: int, grey: NDArray[np.float32]) -> NDArray[np.float32]:
    """The part of an image that shows the target, or all of it."""
    if recording.corners_px is None or not np.isfinite(recording.corners_px[index]).any():
        return grey
    low = np.maximum(np.nanmin(recording.corners_px[index], axis=0), 0).astype(int)
    high = np.nanmax(recording.corners_px[index], axis=0).astype(int) + 1
    part = grey[low[1] : high[1], low[0] : high[0]]
    return part if min(part.shape) >= 3 else grey


def _sharpness(grey: NDArray[np.float32]) -> float:
    if min(grey.shape) < 3:
        return 0.0
    laplacian = grey[1:-1, :-2] + grey[1:-1, 2:] + grey[:-2, 1:-1] + grey[2:, 1:-1] - 4 * grey[1:-1, 1:-1]
    return float((laplacian**2).mean())
