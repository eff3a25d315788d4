"""Changing the camera must be paid for: by predictions that are better, and by parameters that the data determine."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hecbench.recording import CameraModel
from hecbench.system.wording import significant
from hecbench.verdict.answers import Answer, predicts_better

_DETERMINED = 0.5
"""Posterior sigma over prior sigma above which the samples say little about a parameter of K."""
_FAR = 3.0
"""Posterior sigmas: a parameter of K that moved farther contradicts the given camera."""
_WORTH = 0.6
"""Of the fixed camera's rms px on left-out samples: what a real lens leaves over beside its model lets any free
parameter gain some ten per cent; a camera that is wrong for its recording costs more."""


def contradicts(free: Answer, fixed: Answer, given: CameraModel | None) -> bool:
    """Whether an answer with its own camera shows that the recording's camera is wrong.

    It must predict the corners of left-out samples better than the fixed camera by far and beyond chance, and a
    parameter of K must lie far from the given one.
    """
    px = [(answer.estimate.held_out or {}).get("reprojection_px") for answer in (free, fixed)]
    if px[0] is None or px[1] is None or px[0] > _WORTH * px[1]:
        return False
    return predicts_better(free.estimate, fixed.estimate, ("reprojection_px",)) and far_from_given(
        free, given
    )


def earned(free: Answer, fixed: Answer, given: CameraModel | None) -> bool:
    """Whether an answer with its own camera is to be preferred: the given one is wrong, and its own is determined."""
    better = predicts_better(free.estimate, fixed.estimate, ("target_mm",))
    return contradicts(free, fixed, given) and better and determined(free)


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
    return (
        f"moves the principal point by {significant(float(centre))} px and the focal length by {focal:+.2g} %"
    )


def suspicion(answers: Sequence[Answer], best: Answer, given: CameraModel | None) -> str | None:
    """What to say of the lens when the given camera is contradicted; None when it is not."""
    fixed = (
        [best] if not best.moved_camera else [a for a in answers if not a.moved_camera and a.has_covariance()]
    )
    for free in answers:
        if free.moved_camera and fixed and contradicts(free, fixed[0], given):
            return (
                f"{free.solver} {moved(free, given)} and predicts left-out corners better: the recording's camera is"
                " off by so much"
            )
    return None


def far_from_given(free: Answer, given: CameraModel | None) -> bool:
    """Whether a parameter of K lies far from the given one, in sigmas of its posterior."""
    camera, sigma = free.estimate.camera, free.estimate.extras.get("intrinsics_sigma")
    if camera is None or given is None or camera.K is None or given.K is None or not sigma:
        return False
    change = np.array([camera.K[i] - given.K[i] for i in ((0, 0), (1, 1), (0, 2), (1, 2))])
    return bool((np.abs(change) > _FAR * np.asarray(sigma[:4], float)).any())
