"""Intrinsics from the same images (Zhang 2000, "A flexible new technique for camera calibration").

Of the lens models the richest is taken that predicts left-out images as well as the best one (Stone 1974,
"Cross-validatory choice and assessment of statistical predictions") and whose terms the views determine up to the
picture's corners. A term that they do not determine fits their noise, and takes focal length and centre with it; one
that is left out although the lens has it shifts them by more than their standard deviations say.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import CameraModel
from hecbench.samples.spread import evenly
from hecbench.se3 import Array
from hecbench_plugins.detection.settings import INTRINSICS

TERMS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
LENSES = (
    (),
    ("k1",),
    ("k1", "k2"),
    ("k1", "p1", "p2"),
    ("k1", "k2", "p1", "p2"),
    ("k1", "k2", "p1", "p2", "k3"),
)
"""The lens models, by the terms that are free, from the poorest to the richest."""
FEW_VIEWS_LENS = LENSES[1]
"""Of fewer views than can be left out in turn."""

Views = list[tuple[NDArray[np.float32], NDArray[np.float32]]]
"""Points (P, 3) m and corners (P, 2) px of each view."""


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A camera from its pictures.

    Attributes:
        camera: with five coefficients of distortion, those that are not free 0.
        rms_px: of the reprojection.
        sigmas: standard deviations of `TERMS` (9,), px and 1; 0 of terms that are not free.
        lens: the lens terms that are free.
        images: that show the target, and are from different poses.
        coverage: share of the picture within the hull of all corners.
        tilt_rad: largest angle between the target's normals.
    """

    camera: CameraModel
    rms_px: float
    sigmas: Array
    lens: tuple[str, ...]
    images: int
    coverage: float
    tilt_rad: float

    def __str__(self) -> str:
        K = self.camera.intrinsics
        values = [K[0, 0], K[1, 1], K[0, 2], K[1, 2], *self.camera.distortion]
        free = [*TERMS[:4], *self.lens]
        shown = [
            f"{name} {value:.{1 if name in TERMS[:4] else 4}f} +- {sigma:.{1 if name in TERMS[:4] else 4}f}"
            for name, value, sigma in zip(TERMS, values, self.sigmas, strict=True)
            if name in free
        ]
        return (
            f"intrinsics calibrated from {self.images} images: {', '.join(shown)}; rms {self.rms_px:.2f} px; the "
            f"corners cover {100 * self.coverage:.0f} % of the picture, the target's tilt changes by up to "
            f"{np.rad2deg(self.tilt_rad):.0f} deg"
        )


@dataclass(frozen=True, eq=False)
class _Fit:
    K: Array
    distortion: Array
    rms_px: float
    sigmas: Array
    normals: Array


def calibrate(points_m: Array, corners_px: Array, size: tuple[int, int]) -> Calibrated:
    """K and distortion from a planar target's points (P, 3) m and corners (N, P, 2) px, NaN where not seen.

    Raises:
        InputError: fewer than 3 different views show 6 points, the target is not planar, or the views leave the focal
            length or the centre open.
    """
    views = _different(points_m, corners_px)
    if len(views) < INTRINSICS.least_images:
        raise InputError(
            f"camera.K: is unknown, and {len(views)} images from different poses show {INTRINSICS.least_points} or "
            f"more target points; calibrating it takes {INTRINSICS.least_images}: give K, or more images"
        )
    if (points_m[:, 2] != 0).any():
        raise InputError(
            "camera.K: is unknown, and cannot be calibrated from a target that is not flat: give K"
        )
    lens = _lens(views, size)
    fit = _fitted(views, size, lens)
    tilt = float(np.arccos(np.clip(fit.normals @ fit.normals.T, -1, 1)).max())
    _refuse_undetermined(fit, tilt, size)
    camera = CameraModel(*size, fit.K, fit.distortion)
    return Calibrated(camera, fit.rms_px, fit.sigmas, lens, len(views), _coverage(views, size), tilt)


def _refuse_undetermined(fit: _Fit, tilt: float, size: tuple[int, int]) -> None:
    if tilt < INTRINSICS.least_tilt_rad:
        raise InputError(
            f"camera.K: the views are within {np.rad2deg(tilt):.1f} degrees of each other, which leaves the "
            "focal length open; tilt the target"
        )
    focal, centre = float(fit.sigmas[:2].max()), float(fit.sigmas[2:4].max())
    if not np.isfinite(fit.K).all() or not focal < INTRINSICS.most_uncertain * fit.K[0, 0]:
        raise InputError(
            f"camera.K: the views leave the focal length at {fit.K[0, 0]:.0f} +- {focal:.0f} px; tilt the target"
        )
    if not centre < INTRINSICS.most_uncertain_centre * size[0]:
        raise InputError(
            f"camera.K: the views leave the centre at ({fit.K[0, 2]:.0f}, {fit.K[1, 2]:.0f}) +- {centre:.0f} px; tilt "
            "the target to all sides, and show it in the picture's corners too"
        )


def _different(points_m: Array, corners_px: Array) -> Views:
    """The views that show enough of the target, one of those in which it stands still."""
    kept: list[Array] = []
    for corners in corners_px:
        if np.isfinite(corners[:, 0]).sum() >= INTRINSICS.least_points and not any(
            _same(corners, other) for other in kept
        ):
            kept.append(corners)
    seen = [np.isfinite(corners[:, 0]) for corners in kept]
    return [
        (points_m[mask].astype(np.float32), corners[mask].astype(np.float32))
        for mask, corners in zip(seen, kept, strict=True)
    ]


def _same(corners: Array, other: Array) -> bool:
    squares = ((corners - other) ** 2).sum(1)
    both = np.isfinite(squares)
    return bool(both.any() and np.sqrt(squares[both].mean()) < INTRINSICS.same_px)


def _lens(views: Views, size: tuple[int, int]) -> tuple[str, ...]:
    """The richest lens that predicts left-out views as well as any, and is known up to the corners."""
    if len(views) < INTRINSICS.folds:
        return FEW_VIEWS_LENS
    compared = [views[i] for i in evenly(len(views), INTRINSICS.most_compared)]
    errors = [float(_predicted(compared, size, lens).mean()) for lens in LENSES]
    good = [
        lens for lens, error in zip(LENSES, errors, strict=True) if error <= INTRINSICS.as_well * min(errors)
    ]
    known = [
        lens
        for lens in good
        if _corner_sigma(_fitted(views, size, lens), lens, size) < INTRINSICS.corner_share
    ]
    return known[-1] if known else good[0]


def _corner_sigma(fit: _Fit, lens: Sequence[str], size: tuple[int, int]) -> float:
    """Relative standard deviation of where a point in the picture's corner is, by the last radial term alone."""
    radial = [term for term in lens if term.startswith("k")]
    if not radial:
        return 0.0
    radius = float(np.hypot(size[0] / fit.K[0, 0], size[1] / fit.K[1, 1])) / 2
    return float(fit.sigmas[TERMS.index(radial[-1])]) * radius ** (2 * len(radial))


def _predicted(views: Views, size: tuple[int, int], lens: tuple[str, ...]) -> Array:
    """Mean squared error, px^2, of each view (N,) when the camera comes from the others."""
    import cv2

    errors = np.full(len(views), np.inf)
    for fold in range(INTRINSICS.folds):
        left_out = range(fold, len(views), INTRINSICS.folds)
        try:
            fit = _fitted([view for i, view in enumerate(views) if i % INTRINSICS.folds != fold], size, lens)
        except InputError:
            continue
        for i in left_out:
            points, corners = views[i]
            found, rotvec, shift = cv2.solvePnP(points, corners, fit.K, fit.distortion)
            if found:
                seen, _ = cv2.projectPoints(points, rotvec, shift, fit.K, fit.distortion)
                errors[i] = float(((seen[:, 0] - corners) ** 2).sum(1).mean())
    return np.asarray(np.minimum(errors, float(size[0]) ** 2))


def _fitted(views: Views, size: tuple[int, int], lens: Sequence[str]) -> _Fit:
    import cv2

    fixed = {
        "k1": cv2.CALIB_FIX_K1,
        "k2": cv2.CALIB_FIX_K2,
        "k3": cv2.CALIB_FIX_K3,
        "p1": cv2.CALIB_ZERO_TANGENT_DIST,
    }
    flags = sum(flag for term, flag in fixed.items() if term not in lens)
    points, corners = zip(*views, strict=True)
    try:
        rms, K, distortion, rotvecs, _, sigmas, _, _ = cv2.calibrateCameraExtended(
            points, corners, size, None, None, flags=flags
        )
    except cv2.error as error:
        raise InputError(f"camera.K: the views do not determine it ({error.err}); tilt the target") from error
    normals = se3.so3_exp(np.reshape(rotvecs, (-1, 3)))[:, :, 2]
    return _Fit(K, distortion.ravel()[:5], float(rms), np.ravel(sigmas)[: len(TERMS)], normals)


def _coverage(views: Views, size: tuple[int, int]) -> float:
    """Share of the picture within the hull of all corners."""
    import cv2

    hull = cv2.convexHull(np.concatenate([corners for _, corners in views]))
    return float(cv2.contourArea(hull)) / (size[0] * size[1])
