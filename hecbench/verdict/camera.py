"""Changing the camera must be paid for: by predictions that are better, and by parameters that the data determine."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hecbench.recording import CameraModel
from hecbench.verdict.answers import Answer, predicts_better

_DETERMINED = 0.5
"""Posterior sigma over prior sigma above which the samples say little about a parameter of K."""
_FAR = 3.0
"""Prior sigmas: a parameter moved farther contradicts the given camera, or is not what moved."""


def earned(free: Answer, fixed: Answer) -> bool:
    """Whether an answer with its own camera is to be preferred to one with the recording's.

    Both pixels and millimetres of left-out samples must be predicted better than by the fixed camera, and focal lengths
    and principal point must be determined by the samples.
    """
    return predicts_better(free.estimate, fixed.estimate, ("reprojection_px", "target_mm")) and determined(
        free
    )


def determined(free: Answer) -> bool:
    """Whether the samples shrink the prior of focal lengths and principal point by half."""
    extras = free.estimate.extras
    posterior, prior = extras.get("intrinsics_sigma"), extras.get("intrinsics_prior_sigma")
    if not posterior or not prior:
        return False
    ratio = np.asarray(posterior[:4], float) / np.asarray(prior[:4], float)
    return bool((ratio < _DETERMINED).all())


def moved(free: Answer, given: CameraModel | None) -> str:
    """In words, how far the camera of an answer is from the recording's."""
    camera = free.estimate.camera
    if camera is None or given is None or camera.K is None or given.K is None:
        return "brings its own camera"
    focal = 100 * (np.sqrt(np.linalg.det(camera.K[:2, :2]) / np.linalg.det(given.K[:2, :2])) - 1)
    centre = np.linalg.norm(camera.K[:2, 2] - given.K[:2, 2])
    return f"moves the principal point by {centre:.2g} px and the focal length by {focal:+.2g} %"


def suspicion(frees: Sequence[Answer], fixed: Answer, given: CameraModel | None) -> str | None:
    """What to say of the lens when a freed camera predicts better but is not determined; None when it does not."""
    for free in frees:
        if predicts_better(free.estimate, fixed.estimate, ("reprojection_px",)) and far_from_prior(
            free, given
        ):
            return (
                f"{free.solver} {moved(free, given)} and predicts left-out corners better: the intrinsics may be off by"
                " so much; calibrate the lens again"
            )
    return None


def far_from_prior(free: Answer, given: CameraModel | None) -> bool:
    """Whether a parameter of K lies far from the given one, in sigmas of its posterior."""
    camera, sigma = free.estimate.camera, free.estimate.extras.get("intrinsics_sigma")
    if camera is None or given is None or camera.K is None or given.K is None or not sigma:
        return False
    change = np.array([camera.K[i] - given.K[i] for i in ((0, 0), (1, 1), (0, 2), (1, 2))])
    return bool((np.abs(change) > _FAR * np.asarray(sigma[:4], float)).any())
