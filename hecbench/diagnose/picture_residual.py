"""The pictures' own residual, before any robot pose: whether lens, camera matrix and board fit the corners."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity
from hecbench.diagnose.rivals import (
    BOARD,
    GIVEN,
    LENS,
    MATRIX,
    ORDER,
    RESOLUTION,
    Judged,
    comparable,
    judged,
    rivals,
)
from hecbench.lens import EQUIDISTANT, CameraModel, parameters_of
from hecbench.system.wording import significant
from hecbench.targets import PointsTarget

ID = "picture_residual"
IDS = {
    LENS: "lens_model",
    MATRIX: "intrinsics",
    RESOLUTION: "intrinsics",
    BOARD: "target_shape",
    ORDER: "corner_order",
}
"""The finding that names each cause."""
_MOST_PICTURES = 40
_CLEARLY = 20.0
"""Fall of the information criterion that counts; 10 is called very strong (Kass and Raftery 1995, section 3.2)."""
_ALIKE = 10.0
_TIMES_NOISE = 1.5
_NOTICEABLE_TIMES_NOISE = 1.2
_LEAST_PX = 0.2
"""Systematic residual below which the answer suffers little."""
_UNEXPLAINED = 0.03
"""Of the target's size in the picture: no detector is so bad."""
_REFIT = "calibrate the camera anew, or use what fits: "


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """The corners' distance from the best target pose of each picture, and which other reading leaves only noise."""
    if case.recording.corners_px is None or case.fitted_intrinsics:
        return None, case
    part = comparable(case.recording, _MOST_PICTURES)
    found = judged(rivals(part)) if part is not None else []
    given = next((result for result in found if result.rival.cause == GIVEN), None)
    if given is None or part is None:
        return None, case
    best = found[0]
    systematic_px = float(np.sqrt(max(given.noise_px**2 - best.noise_px**2, 0.0)))
    ratio = given.noise_px / best.noise_px
    clear = given.score - best.score > _CLEARLY and ratio > _NOTICEABLE_TIMES_NOISE
    if not clear:
        return _unexplained(case, given)
    finding, cured = _named(case, given, best, _equal(found))
    if ratio > _TIMES_NOISE and systematic_px > _LEAST_PX:
        return finding, cured
    return replace(finding, severity=Severity.WARNING), case


def _unexplained(case: Examination, given: Judged) -> tuple[Finding, Examination]:
    """No reading is better: fine, unless the corners are far from any board."""
    corners = given.rival.recording.present.corners_px
    size_px = float(
        np.median(np.linalg.norm(np.nanmax(corners, axis=1) - np.nanmin(corners, axis=1), axis=1))
    )
    summary = f"each picture alone fits to {significant(given.noise_px)} px"
    limit = _UNEXPLAINED * size_px
    if given.noise_px > limit:
        summary += f", of a target {size_px:.0f} px wide: the corners are not those of the declared target"
        action = "look at the corners with `hecbench detect`; correct the target's kind, columns and rows"
        return Finding(ID, Severity.CRITICAL, summary, action, given.noise_px, limit), replace(
            case, judged=False
        )
    return Finding(ID, Severity.OK, summary, value=given.noise_px, limit=limit), replace(
        case, noise_px=given.noise_px
    )


def _equal(found: list[Judged]) -> list[Judged]:
    """The best rival of every cause that the data cannot distinguish from the best of all."""
    causes: dict[str, Judged] = {}
    for result in found:
        if result.score < found[0].score + _ALIKE:
            causes.setdefault(result.rival.cause, result)
    return list(causes.values())


def _named(
    case: Examination, given: Judged, best: Judged, equal: list[Judged]
) -> tuple[Finding, Examination]:
    left = f"the pictures alone leave {significant(given.noise_px)} px, otherwise {significant(best.noise_px)} px"
    says, cure = _described(best, case)
    if len(equal) > 1:
        others = "; or ".join(f"{_described(other, case)[0]}" for other in equal[1:])
        says, cure = f"{says}; or {others}: the data cannot tell which", f"{cure}; or mend the other"
    finding = Finding(
        IDS[best.rival.cause],
        Severity.CRITICAL,
        f"the lens model or the board does not fit the pictures: {says} ({left})",
        cure,
        given.noise_px,
        best.noise_px,
    )
    return finding, _cured(case, best)


def _described(result: Judged, case: Examination) -> tuple[str, str]:
    """The fault with its numbers, and its cure."""
    rival, fit = result.rival, result.fit
    given = case.recording.present.camera
    camera = _camera(result)
    if rival.cause == BOARD:
        change = 100 * (fit.pitch - 1)
        says = (
            f"the squares are not square: from row to row they are {abs(change):.1f} % "
            f"{'shorter' if change < 0 else 'longer'} than along a row"
        )
        return (
            says,
            "measure the printed board both ways; give it as target kind points, or print it without scaling",
        )
    if rival.cause == MATRIX:
        return (
            f"{rival.says}: {_matrix(given, camera)}",
            f"{_REFIT}{_matrix_values(camera)}; rectified pictures need the matrix P of the rectification",
        )
    if rival.free:
        values = f"distortion [{', '.join(significant(k, 4) for k in camera.distortion)}]"
        if camera.distortion_model == EQUIDISTANT:
            values += ' with distortion_model "equidistant"'
        matrix = "" if 0 not in rival.free else f"{_matrix_values(camera)}, "
        return rival.says, f"run `hecbench detect --refit-intrinsics` on the images, or use {matrix}{values}"
    return rival.says, rival.cure


def _matrix(given: CameraModel, camera: CameraModel) -> str:
    before, after = parameters_of(given), parameters_of(camera)
    focal = float(np.sqrt(after[0] * after[1] / before[0] / before[1]))
    shift = after[2:4] - before[2:4]
    return f"a focal length {focal:.3f} of the given one and a centre {shift[0]:+.0f}, {shift[1]:+.0f} px away fit"


def _matrix_values(camera: CameraModel) -> str:
    fx, fy, cx, cy = parameters_of(camera)[:4]
    return f"fx {fx:.1f}, fy {fy:.1f}, cx {cx:.1f}, cy {cy:.1f}"


def _camera(result: Judged) -> CameraModel:
    camera = result.rival.recording.present.camera
    fx, fy, cx, cy = result.fit.parameters[:4]
    K = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    return replace(camera, K=K, distortion=result.fit.parameters[4:])


def _cured(case: Examination, best: Judged) -> Examination:
    """The case with the camera, board or order of corners that fits."""
    recording = replace(case.recording, camera=_camera(best))
    if best.rival.cause == BOARD:
        recording = replace(
            recording, target=PointsTarget.of(recording.present.target.points_m * [1.0, best.fit.pitch, 1.0])
        )
    if best.rival.order is not None:
        recording = replace(recording, corners_px=recording.present.corners_px[:, best.rival.order])
    return replace(case, recording=recording, noise_px=best.noise_px)
