"""A target of another size than declared, or a camera of another focal length or centre: which moves as it should.

Either makes the target seem to move farther, or less far, than the robot carries it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hecbench.diagnose import intrinsics
from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity
from hecbench.diagnose.size_or_camera import ALIKE, CLEARLY, GIVEN, SIZE, Explanation, explanations
from hecbench.recording import CameraModel

ID = "target_scale"
LIMIT = 0.025
NOTICEABLE = 0.012
CENTRE_LIMIT = 0.04
CENTRE_NOTICEABLE = 0.015
"""Of the image's width: a crop moves the centre farther; calibrations of one camera differ by less than either."""
_SIGMAS = 3.0


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """The true size over the declared one from the robot's motion, unless another camera explains it better."""
    if case.solution is None:
        return None, case
    ranked = explanations(case)
    given = next((one for one in ranked if one.freed == GIVEN), None)
    clear = given is not None and given.score - ranked[0].score > CLEARLY
    alike = [one for one in ranked if one.score < ranked[0].score + ALIKE and one.freed != GIVEN]
    if clear and alike[0].freed != SIZE:
        return _camera(case, alike)
    others = [one for one in alike if one.freed != SIZE] if clear else []
    return _size(case, others[:1])


def _size(case: Examination, others: list[Explanation]) -> tuple[Finding, Examination]:
    """The target's size, when nothing else explains the motion better; `others` explain it as well."""
    assert case.solution is not None
    scale = case.solution.state.scale
    sigma = scale * float(np.sqrt(case.solution.covariance[12, 12])) * case.noise_factor
    deviation = abs(scale - 1)
    summary = f"the robot's motion says that the target is {scale:.4f} +- {sigma:.4f} of the declared size"
    action = f"measure the printed target with a ruler: {scale:.3f} of the declared size is expected"
    for other in others:
        summary += f"; the data cannot tell this from another camera: {_values(case, other)}"
        action += "; if it has its size, calibrate the camera anew"
    if deviation > LIMIT and deviation > _SIGMAS * sigma:
        cured = replace(case, size_factor=case.size_factor * scale)
        return Finding(ID, Severity.CRITICAL, summary, action, scale, LIMIT), cured
    if deviation > NOTICEABLE and deviation > _SIGMAS * sigma:
        return Finding(ID, Severity.WARNING, summary, action, scale, LIMIT), case
    return Finding(ID, Severity.OK, summary, value=scale, limit=LIMIT), case


def _camera(case: Examination, alike: list[Explanation]) -> tuple[Finding, Examination]:
    """Another focal length or principal point, and whether the target's size would do as well."""
    best, camera = alike[0], case.recording.present.camera
    focal, shift = _change(camera, best)
    summary = f"the robot's motion contradicts camera.K, not the target's size: {_values(case, best)}"
    action = "calibrate the camera anew; rectified or cropped pictures need their own matrix"
    for other in alike:
        if other.freed == SIZE:
            summary += f"; the data cannot tell this from a target of {other.scale:.3f} of its size"
            action += "; measure the printed target too"
    far, noticeable = (
        abs(focal - 1) > limit or shift > centre
        for limit, centre in ((LIMIT, CENTRE_LIMIT), (NOTICEABLE, CENTRE_NOTICEABLE))
    )
    severity = Severity.CRITICAL if far else Severity.WARNING if noticeable else Severity.OK
    finding = Finding(
        intrinsics.ID, severity, summary, "" if severity is Severity.OK else action, focal, LIMIT
    )
    return finding, _cured(case, camera, best) if far else case


def _change(camera: CameraModel, found: Explanation) -> tuple[float, float]:
    """The focal length over the given one, and the shift of the centre over the image's width."""
    fx, fy, cx, cy = found.parameters[:4]
    focal = float(np.sqrt(fx * fy / camera.intrinsics[0, 0] / camera.intrinsics[1, 1]))
    return focal, float(np.hypot(cx - camera.intrinsics[0, 2], cy - camera.intrinsics[1, 2])) / camera.width


def _values(case: Examination, found: Explanation) -> str:
    camera = case.recording.present.camera
    focal, _ = _change(camera, found)
    fx, fy, cx, cy = found.parameters[:4]
    return f"{found.freed} fx {fx:.1f}, fy {fy:.1f} ({focal:.3f} of the given), cx {cx:.1f}, cy {cy:.1f} fits"


def _cured(case: Examination, camera: CameraModel, found: Explanation) -> Examination:
    fx, fy, cx, cy = found.parameters[:4]
    K = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    return replace(case, recording=replace(case.recording, camera=replace(camera, K=K)))
