"""The least squares of several frames: the reference of the first ones, and the camera's offset from it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from hecbench import se3
from hecbench.se3 import Array
from hecbench_plugins.maskless.contour import ContourEquations
from hecbench_plugins.watching.settings import WatchSettings


@dataclass(frozen=True, eq=False)
class Reference:
    """What the first frames say: the pose about which all is linearised, and what they left open."""

    camera_T_parent: Array
    offsets_rad: Array
    joint_information: Array
    covariance: Array
    confirmed: float
    noise: float


def concluded(
    frames: Sequence[ContourEquations], camera_T_parent: Array, offsets_rad: Array, settings: WatchSettings
) -> Reference:
    """The least squares of the first frames over the camera and the joints' offsets, from where they were compared."""
    joints = len(offsets_rad)
    A, b = _added(frames)
    prior = np.r_[np.full(6, 1e-9), np.full(joints, settings.correlated_points / settings.joint_sigma_rad**2)]
    information = A + np.diag(prior)
    move = np.linalg.solve(information, b)
    freedom = [(f.b - f.A @ move)[:6] @ np.linalg.solve(f.A[:6, :6], (f.b - f.A @ move)[:6]) for f in frames]
    noise = max(1.0, float(np.median(freedom)) / (6 * settings.correlated_points))
    covariance = settings.correlated_points * noise * np.linalg.inv(information)
    return Reference(
        se3.exp(move[:6]) @ camera_T_parent,
        offsets_rad + move[6:],
        np.asarray(np.linalg.inv(covariance[6:, 6:]), float),
        covariance[:6, :6],
        float(np.median([f.confirmed_share for f in frames])),
        noise,
    )


def offset(
    frames: Iterable[ContourEquations], reference: Reference, settings: WatchSettings
) -> tuple[Array, Array]:
    """The camera's offset (6,) from the reference, and its covariance, the joints eliminated."""
    scale = settings.correlated_points * reference.noise
    A, b = (part / scale for part in _added(list(frames)))
    gain = np.linalg.solve(A[6:, 6:] + reference.joint_information, np.column_stack([A[6:, :6], b[6:]]))
    reduced = A[:6, :6] - A[:6, 6:] @ gain[:, :6] + 1e-9 * np.eye(6)
    covariance = np.linalg.inv(reduced)
    return covariance @ (b[:6] - A[:6, 6:] @ gain[:, 6]), np.asarray(covariance, float)


def _added(frames: Sequence[ContourEquations]) -> tuple[Array, Array]:
    """The normal equations of all frames."""
    return np.sum([frame.A for frame in frames], 0), np.sum([frame.b for frame in frames], 0)
