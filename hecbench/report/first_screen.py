"""The first screen of a page: the verdict, and the photographs through the recommended answer."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hecbench.report.cells import number
from hecbench.report.dots import dot_plot
from hecbench.verdict import Verdict
from hecbench.verdict.result import spelled

_GRADES = {"good": "good", "usable": "usable", "doubtful": "doubtful", "do_not_use": "never"}


@dataclass(frozen=True)
class FirstScreen:
    """What the template shows, as text.

    Attributes:
        look: style of the grade.
        transform: title and text of each spelling of the transform.
        camera: the camera that belongs to it, lines; empty when the method kept the recording's.
        sigmas: of the answer's parent frame, by the covariance; empty without one.
        pictures: sample and data URI of each photograph.
    """

    verdict: Verdict
    look: str
    transform: list[tuple[str, str]]
    camera: list[str]
    sigmas: str
    pictures: list[tuple[str, str]]
    dots: str | None


def first_screen(verdict: Verdict, pictures: Mapping[str, bytes]) -> FirstScreen:
    """The text of a verdict with its pictures."""
    best = verdict.recommended
    camera: list[str] = []
    if best is not None and best.camera is not None and best.diagnostics.get("camera_changed"):
        rows = [] if best.camera.K is None else best.camera.K.round(3).tolist()
        camera = [f"K = {rows}", f"distortion = {best.camera.distortion.round(6).tolist()}"]
    agreeing = [each.solver for each in verdict.agreement]
    return FirstScreen(
        verdict,
        _GRADES[verdict.grade],
        _transform(verdict),
        camera,
        _sigmas(verdict),
        [
            (name, f"data:image/jpeg;base64,{base64.b64encode(jpeg).decode()}")
            for name, jpeg in pictures.items()
        ],
        dot_plot(verdict.estimates, best.solver if best else None, agreeing),
    )


def _transform(verdict: Verdict) -> list[tuple[str, str]]:
    best = verdict.recommended
    if best is None or best.parent_T_camera is None:
        return []
    rows = "\n".join(" ".join(f"{value:10.6f}" for value in row) for row in best.parent_T_camera)
    spellings = spelled(best.parent_T_camera)

    def text(values: list[float]) -> str:
        return " ".join(f"{value:.6f}" for value in values)

    return [
        ("4x4", rows),
        ("translation, m", text(spellings["translation_m"])),
        ("quaternion x y z w", text(spellings["quaternion_xyzw"])),
        ("roll pitch yaw, rad", text(spellings["rpy_rad"])),
    ]


def _sigmas(verdict: Verdict) -> str:
    best: Any = verdict.recommended
    if best is None or best.covariance is None:
        return ""
    sigmas = np.sqrt(np.diag(np.asarray(best.covariance, float)))
    turn = ", ".join(number(float(np.rad2deg(value))) for value in sigmas[:3])
    shift = ", ".join(number(1e3 * float(value)) for value in sigmas[3:])
    return f"the method's own sigmas about the axes of {best.parent_link}: turn {turn} deg, shift {shift} mm"
