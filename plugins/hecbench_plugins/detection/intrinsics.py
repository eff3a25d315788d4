"""Intrinsics from the same images (Zhang 2000, "A flexible new technique for camera calibration")."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import CameraModel
from hecbench.se3 import Array

LEAST_IMAGES = 3
LEAST_POINTS = 6
_ENOUGH_FOR_ALL_TERMS = 10
"""Below so many images only k1 and k2 are estimated: the tangential terms and k3 would fit the noise."""
_MOST_UNCERTAIN = 0.1
_LEAST_TILT_RAD = np.deg2rad(8.0)


@dataclass(frozen=True, eq=False)
class Calibrated:
    """The camera, its reprojection rms in px, and the standard deviation of its focal length in px."""

    camera: CameraModel
    rms_px: float
    focal_sigma_px: float
    images: int


def calibrate(points_m: Array, corners_px: Array, size: tuple[int, int]) -> Calibrated:
    """K and distortion from a planar target's points (P, 3) m and corners (N, P, 2) px, NaN where not seen.

    Raises:
        InputError: fewer than 3 images show 6 points, the target is not planar, or the views are too alike
            to tell the focal length.
    """
    import cv2

    seen = [np.isfinite(corners[:, 0]) for corners in corners_px]
    used = [i for i, mask in enumerate(seen) if mask.sum() >= LEAST_POINTS]
    if len(used) < LEAST_IMAGES:
        raise InputError(
            f"camera.K: is unknown, and {len(used)} images show {LEAST_POINTS} or more target points; "
            f"calibrating it takes {LEAST_IMAGES}: give K, or more images"
        )
    if (points_m[:, 2] != 0).any():
        raise InputError(
            "camera.K: is unknown, and cannot be calibrated from a target that is not flat: give K"
        )
    object_points = [points_m[seen[i]].astype(np.float32) for i in used]
    image_points = [corners_px[i][seen[i]].astype(np.float32) for i in used]
    flags = 0
    if len(used) < _ENOUGH_FOR_ALL_TERMS:
        flags = cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST
    try:
        rms, K, distortion, rotvecs, _, sigmas, _, _ = cv2.calibrateCameraExtended(
            object_points, image_points, size, None, None, flags=flags
        )
    except cv2.error as error:
        raise InputError(f"camera.K: the views do not determine it ({error.err}); tilt the target") from error
    normals = se3.so3_exp(np.reshape(rotvecs, (-1, 3)))[:, :, 2]
    tilt = float(np.arccos(np.clip(normals @ normals.T, -1, 1)).max())
    if tilt < _LEAST_TILT_RAD:
        raise InputError(
            f"camera.K: the views are within {np.rad2deg(tilt):.1f} degrees of each other, which leaves the "
            "focal length open; tilt the target"
        )
    sigma = float(np.max(sigmas[:2]))
    if not np.isfinite(K).all() or not sigma < _MOST_UNCERTAIN * K[0, 0]:
        raise InputError(
            f"camera.K: the views leave the focal length at {K[0, 0]:.0f} +- {sigma:.0f} px; tilt the target"
        )
    return Calibrated(CameraModel(*size, K, distortion.ravel()[:5]), float(rms), sigma, len(used))
