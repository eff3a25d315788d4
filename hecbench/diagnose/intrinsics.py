"""Intrinsics that belong to another resolution than the corners."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity
from hecbench.diagnose.fit import EXPLAINS, Fit
from hecbench.diagnose.resolution import BY_SIZE, OFF_CENTRE, off_centre, rescaled, scaled
from hecbench.errors import InputError
from hecbench.recording import CameraModel, Recording
from hecbench.system import pictures
from hecbench.system.wording import significant

ID = "intrinsics"
_HALF = 0.5
_SAME_RATIO = 0.05
"""Of the relative position of the principal point across and down; a crop seldom keeps both."""
_SUSPICIOUS_PX = 4.0
_SUSPICIOUS_SCALE = 0.02
_SAME_SIZE = 0.1
"""Deviation of the target's apparent size that the right intrinsics may leave."""


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """The principal point against the image's centre; where suspicious, how rescaled intrinsics would fit."""
    camera = case.recording.camera
    if camera is None:
        return None, case
    if (size := _image_size(case.recording)) and size != (camera.width, camera.height):
        summary = f"the images are {size[0]}x{size[1]} px, the camera {camera.width}x{camera.height}"
        ratio = size[0] / camera.width
        return Finding(ID, Severity.CRITICAL, summary, BY_SIZE, ratio, 1.0), case
    if camera.K is None or case.fitted_intrinsics:
        return Finding(ID, Severity.INFO, "no intrinsics are given", "calibrate them from the images"), case
    offset = off_centre(camera)
    outside = _outside(case.recording)
    fit = case.fit
    suspicious = (
        offset > OFF_CENTRE
        or outside > 0
        or (fit is not None and fit.typical_px > _SUSPICIOUS_PX)
        or (fit is not None and abs(fit.state.scale - 1) > _SUSPICIOUS_SCALE)
    )
    if suspicious and case.recording.corners_px is not None and case.can_be_fitted:
        plausible = (
            found for found in _rescaled_fits(case, camera) if abs(found[2].state.scale - 1) < _SAME_SIZE
        )
        best = min(plausible, key=lambda found: found[0], default=None)
        if best is not None and best[2].relative < EXPLAINS and best[0] < _HALF * _angle(fit, camera.K[0, 0]):
            ratio, better = best[1], best[2]
            summary = (
                f"the intrinsics are of another resolution: times {significant(ratio, 3)} the typical sample fits to "
                f"{significant(better.typical_px)} px, as given to "
                f"{significant(fit.typical_px if fit else np.inf, 3)} px"
            )
            return Finding(ID, Severity.CRITICAL, summary, BY_SIZE, ratio, 1.0), _cured(case, camera, ratio)
    if outside:
        summary = f"{outside} corners lie outside the {camera.width}x{camera.height} image"
        return Finding(ID, Severity.CRITICAL, summary, BY_SIZE, float(outside), 0.0), case
    summary = f"the principal point is {100 * offset:.0f} % of the image's size from its centre"
    if offset <= OFF_CENTRE:
        return Finding(ID, Severity.OK, summary, value=offset, limit=OFF_CENTRE), case
    across, down = camera.K[:2, 2] / [camera.width, camera.height]
    if abs(across - down) < _SAME_RATIO:
        ratio = 1 / (across + down)
        summary += f", as for images of {significant(1 / ratio, 3)} times this size"
        return Finding(ID, Severity.CRITICAL, summary, BY_SIZE, offset, OFF_CENTRE), _cured(
            case, camera, ratio
        )
    action = f"{BY_SIZE}; for a cropped image this may be right"
    return Finding(ID, Severity.WARNING, summary, action, offset, OFF_CENTRE), case


def _image_size(recording: Recording) -> tuple[int, int] | None:
    """Width and height of the first image file, without decoding it."""
    first = next((source for source in recording.images or () if isinstance(source, Path)), None)
    if first is None:
        return None
    try:
        return pictures.size(first)
    except InputError:  # damaged or absent: image_quality says so
        return None


def _outside(recording: Recording) -> int:
    camera, corners = recording.camera, recording.corners_px
    if camera is None or corners is None:
        return 0
    beyond = (corners < -1.0) | (corners > np.array([camera.width, camera.height]))
    return int(beyond.any(-1).sum())


def _cured(case: Examination, camera: CameraModel, ratio: float) -> Examination:
    if camera.K is None:
        return case
    return replace(case, recording=replace(case.recording, camera=scaled(camera, ratio)))


def _rescaled_fits(case: Examination, camera: CameraModel) -> Iterator[tuple[float, float, Fit]]:
    """Typical residual (rad) and the fit for every ratio that can be fitted."""
    for ratio, rescaled_camera in rescaled(camera):
        other = replace(case, recording=replace(case.recording, camera=rescaled_camera))
        if other.fit is not None:
            yield _angle(other.fit, rescaled_camera.intrinsics[0, 0]), ratio, other.fit


def _angle(fit: Fit | None, focal_px: float) -> float:
    return np.inf if fit is None else fit.typical_px / focal_px
