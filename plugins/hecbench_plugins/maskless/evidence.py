"""What the maskless method says about its answer: covariance, agreement of every photograph, the way it went."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hecbench import se3
from hecbench.estimate import Estimate, Termination
from hecbench.se3 import Array
from hecbench_plugins.maskless.contour import ContourEquations
from hecbench_plugins.maskless.refinement import Refined
from hecbench_plugins.maskless.settings import CONTOUR, COURSE


def covariance(camera_T_parent: Array, last: ContourEquations, prior: Array, shared: Array) -> Array:
    """(6, 6) of parent_T_camera's left perturbation, the joints being off by constants that nobody knows.

    Contour points are correlated along the contour and share what is wrong with their photograph, so the information
    of the lines is divided by a factor: the mean of g' I^-1 g / 6 over the photographs, g the gradient that one
    photograph alone leaves at the common end and I its own information (the scores' variance over their
    expectation; Freedman 2006, "On the so-called Huber sandwich estimator"). With few photographs it stays near
    `CONTOUR.correlated_points`. Errors of the intrinsics are not in it.

    Args:
        camera_T_parent: (4, 4).
        last: the comparison there, with columns for the joints.
        prior: (6 + J,) information about the camera, none, and the joints' offsets.
        shared: (6, 6) of camera_T_parent's left perturbation by what all photographs get wrong alike.
    """
    scores = [
        gradient @ np.linalg.solve(information + 1e-9 * np.trace(information) * np.eye(6), gradient)
        for information, gradient in zip(last.view_A[:, :6, :6], last.view_b[:, :6], strict=True)
        if np.trace(information) > 0
    ]
    freedom = 6.0 * (len(scores) - 1)
    factor = (COURSE.prior_freedom * CONTOUR.correlated_points + sum(scores)) / (
        COURSE.prior_freedom + freedom
    )
    seen_from_camera = np.linalg.inv(last.A / factor + np.diag(prior))[:6, :6]
    return se3.inverse_covariance(camera_T_parent, seen_from_camera + shared)


def to_estimate(
    end: Refined,
    covariance: Array,
    sample_ids: Sequence[str],
    path: Sequence[tuple[str, Array]],
    renders: int,
    diagnostics: Mapping[str, Any],
    extras: Mapping[str, Any],
) -> Estimate:
    """The estimate with its evidence."""
    last = end.last
    shares = {
        name: round(float(share), 3)
        for name, share in zip(sample_ids, last.view_confirmed_share, strict=True)
    }
    return Estimate(
        se3.inverse(end.camera_T_parent),
        covariance=covariance,
        termination=Termination.CONVERGED if end.converged else Termination.MAX_ITERATIONS,
        iterations=end.iterations,
        renders=renders,
        diagnostics={
            "stage": "maskless",
            **diagnostics,
            "confirmed_at_end": last.confirmed_share,
            "confirmed_by_sample": shares,
            "doubtful_samples": [
                name
                for name, share in shares.items()
                if share < COURSE.doubtful * np.median(last.view_confirmed_share)
            ],
            "path": [
                [stage, None, se3.log(se3.inverse(pose)).round(6).tolist()]
                for stage, pose in [*path, ("last", end.camera_T_parent)]
            ],
        },
        extras=extras,
    )
