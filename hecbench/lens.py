"""Cameras and their lens models: ideal normalised coordinates to those of the picture and back, and projection.

`opencv` is OpenCV's rational, tangential, thin-prism and tilted model (OpenCV documentation, "Camera Calibration and
3D Reconstruction"). `equidistant` is the model of fisheye lenses of Kannala and Brandt 2006, "A generic camera model
and calibration method", eq. 6, as OpenCV's fisheye module, ROS and Kalibr write it: four coefficients of the angle.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hecbench.errors import InputError, Refusal
from hecbench.se3 import Array

OPENCV, EQUIDISTANT = "opencv", "equidistant"
DISTORTION_LENGTHS = {OPENCV: (0, 4, 5, 8, 12, 14), EQUIDISTANT: (0, 4)}
"""Numbers of coefficients of each lens model."""
_STEP = 1e-20
"""Of the complex-step derivatives (Squire and Trapp 1998), which are exact to rounding for any small step."""
_ROUNDS = 30
_CONVERGED = 1e-12
_UNDISTORTED = 1e-7
"""Residual, normalised: a ten-thousandth of a pixel."""


def finite(name: str, value: ArrayLike, shape: tuple[int, ...]) -> Array:
    """The value as an array of that shape; `name` is for the error."""
    array = np.asarray(value, float)
    if array.shape != shape or not np.isfinite(array).all():
        raise InputError(
            f"{name}: expected {'x'.join(map(str, shape))} finite numbers, found shape {array.shape}"
        )
    return array


@dataclass(frozen=True, eq=False)
class CameraModel:
    """A pinhole camera in OpenCV's convention: pixel centres at integers, x right, y down, z forward.

    Attributes:
        width: of the image, px.
        height: of the image, px.
        K: (3, 3) px, or None when it is still to be calibrated from the images.
        distortion: (0 | 4 | 5 | 8 | 12 | 14,) coefficients in OpenCV's order; none or k1 to k4 of an equidistant lens.
        distortion_model: "opencv" or "equidistant" (fisheye); see `hecbench.lens`.
    """

    width: int
    height: int
    K: Array | None = None
    distortion: Array = field(default_factory=lambda: np.zeros(0))
    distortion_model: str = OPENCV

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1:
            raise InputError(
                f"camera: size {self.width}x{self.height} is not positive; give the image's size in px"
            )
        if self.K is not None:
            K = finite("camera.K", self.K, (3, 3))
            if K[0, 0] <= 0 or K[1, 1] <= 0 or K[1, 0] or (K[2] != [0, 0, 1]).any():
                raise InputError("camera.K: expected [[fx, s, cx], [0, fy, cy], [0, 0, 1]] with fx, fy > 0")
            if np.array_equal(K, np.eye(3)):
                raise InputError("camera.K: is the identity; give the intrinsics in px, or null if unknown")
            object.__setattr__(self, "K", K)
        distortion = np.asarray(self.distortion, float).reshape(-1)
        if self.distortion_model not in DISTORTION_LENGTHS:
            raise InputError(
                f"camera.distortion_model: '{self.distortion_model}' is not one of {', '.join(DISTORTION_LENGTHS)}"
            )
        lengths = DISTORTION_LENGTHS[self.distortion_model]
        if len(distortion) not in lengths or not np.isfinite(distortion).all():
            raise InputError(f"camera.distortion: {len(distortion)} numbers; give {lengths} finite ones")
        object.__setattr__(self, "distortion", distortion)

    @staticmethod
    def centred(width: int, height: int, focal_px: float) -> CameraModel:
        """Without distortion, the principal point in the middle of the image."""
        K = np.array([[focal_px, 0, (width - 1) / 2], [0, focal_px, (height - 1) / 2], [0, 0, 1]])
        return CameraModel(width, height, K)

    @property
    def intrinsics(self) -> Array:
        """K (3, 3) px.

        Raises:
            Refusal: it is not known.
        """
        if self.K is None:
            raise Refusal("the camera's K is not known; give it, or `--refit-intrinsics`")
        return self.K

    @property
    def is_pinhole(self) -> bool:
        """Whether the lens bends no ray."""
        return self.distortion_model == OPENCV and not self.distortion.any()


def distort(points: Array, camera: CameraModel) -> Array:
    """Distorted normalised coordinates (..., 2) of ideal ones (..., 2)."""
    return np.asarray(_distort(points, camera.distortion, camera.distortion_model))


def _distort(
    points: NDArray[np.inexact], coefficients: NDArray[np.inexact], model: str
) -> NDArray[np.inexact]:
    """`distort` for real or complex numbers."""
    x, y = points[..., 0], points[..., 1]
    r2 = x * x + y * y
    k = np.zeros(14, np.result_type(coefficients, float))
    k[: len(coefficients)] = coefficients
    if model == EQUIDISTANT:
        r = np.sqrt(r2)
        angle = np.arctan(r)
        a2 = angle * angle
        bent = angle * (1 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3]))))
        factor = np.where(r == 0, 1.0, bent / np.where(r == 0, 1.0, r))
        return np.asarray(points * factor[..., None])
    radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))
    if k[5:8].any():
        radial = radial / (1 + r2 * (k[5] + r2 * (k[6] + r2 * k[7])))
    u = x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x)
    v = y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y
    if k[8:12].any():
        u = u + r2 * (k[8] + r2 * k[9])
        v = v + r2 * (k[10] + r2 * k[11])
    if not k[12:].any():
        return np.stack([u, v], -1)
    tilted = np.stack([u, v, np.ones_like(u)], -1) @ _tilt(k[12], k[13]).T
    return np.asarray(tilted[..., :2] / tilted[..., 2:])


def _tilt(about_x: np.inexact, about_y: np.inexact) -> NDArray[np.inexact]:
    cx, sx, cy, sy = np.cos(about_x), np.sin(about_x), np.cos(about_y), np.sin(about_y)
    R = np.array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]]) @ np.array([[1, 0, 0], [0, cx, sx], [0, -sx, cx]])
    return np.asarray(np.array([[R[2, 2], 0, -R[0, 2]], [0, R[2, 2], -R[1, 2]], [0, 0, 1]]) @ R)


def undistort(points: Array, camera: CameraModel) -> Array:
    """Ideal normalised coordinates (..., 2) of distorted ones by Newton's method; NaN where there are none."""
    if camera.is_pinhole:
        return points
    coefficients, model = camera.distortion, camera.distortion_model
    found = points.copy()
    with np.errstate(all="ignore"):
        for _ in range(_ROUNDS):
            bent, by_point = _with_derivative(found, coefficients, model)
            step = _solved(by_point, np.nan_to_num(bent - points))
            found = found - step
            if np.nanmax(np.abs(step), initial=0.0) < _CONVERGED:
                break
        left = _distort(found, coefficients, model) - points
    return np.where((np.abs(left) < _UNDISTORTED).all(-1, keepdims=True), found, np.nan)


def _with_derivative(points: Array, coefficients: Array, model: str) -> tuple[Array, Array]:
    """Distorted coordinates (..., 2), and their derivatives (..., 2, 2) by the ideal ones."""
    moved = [_distort(points + 1j * _STEP * axis, coefficients, model) for axis in np.eye(2)]
    return moved[0].real, np.nan_to_num(np.stack([each.imag / _STEP for each in moved], -1))


def _solved(A: Array, b: Array) -> Array:
    """x (..., 2) of A (..., 2, 2) x = b (..., 2); 0 where A is singular."""
    determinant = A[..., 0, 0] * A[..., 1, 1] - A[..., 0, 1] * A[..., 1, 0]
    x = A[..., 1, 1] * b[..., 0] - A[..., 0, 1] * b[..., 1]
    y = A[..., 0, 0] * b[..., 1] - A[..., 1, 0] * b[..., 0]
    return np.stack([x, y], -1) / np.where(determinant == 0, np.inf, determinant)[..., None]


def normalised(camera: CameraModel, pixels: Array) -> Array:
    """Ideal normalised coordinates (..., 2) of pixels (..., 2), NaN kept; the camera's K must be known."""
    centred = (pixels - camera.intrinsics[:2, 2]) @ np.linalg.inv(camera.intrinsics[:2, :2]).T
    return undistort(centred, camera)


def project(camera: CameraModel, points_c: Array) -> Array:
    """Pixels (..., 2) of points (..., 3) m in the camera's frame; NaN behind the camera. K must be known."""
    ahead = points_c[..., 2:] > 0
    ideal = np.where(ahead, points_c[..., :2] / np.where(ahead, points_c[..., 2:], 1.0), np.nan)
    return np.asarray(distort(ideal, camera) @ camera.intrinsics[:2, :2].T + camera.intrinsics[:2, 2])


def same(camera: CameraModel, other: CameraModel) -> bool:
    """Whether both put every point on the same pixel."""
    if camera.K is None or other.K is None:
        return camera.K is other.K
    models = camera.distortion_model == other.distortion_model
    return models and np.array_equal(parameters_of(camera), parameters_of(other))


def parameters_of(camera: CameraModel) -> Array:
    """[fx, fy, cx, cy, distortion...] of a camera whose K is known."""
    K = camera.intrinsics
    return np.array([K[0, 0], K[1, 1], K[0, 2], K[1, 2], *camera.distortion])


class Sensor:
    """A lens model as a sensor of `bundle.model`, with parameters [fx, fy, cx, cy, distortion...]."""

    def __init__(self, model: str) -> None:
        self.model = model

    def __call__(self, points_c: Array, parameters: Array) -> tuple[Array, Array, Array]:
        """Pixels (M, 2) of points (M, 3) m, and the derivatives by points (M, 2, 3) and parameters (M, 2, K)."""
        focal, coefficients = parameters[:2], parameters[4:]
        ideal = points_c[:, :2] / points_c[:, 2:]
        pixels, by_point = pixels_and_derivative(points_c, parameters, self.model)
        by_parameter = np.zeros((len(ideal), 2, len(parameters)))
        by_parameter[:, [0, 1], [0, 1]] = (pixels - parameters[2:4]) / focal
        by_parameter[:, [0, 1], [2, 3]] = 1.0
        for k, axis in enumerate(np.eye(len(coefficients))):
            bent = _distort(ideal, coefficients + 1j * _STEP * axis, self.model)
            by_parameter[:, :, 4 + k] = focal * bent.imag / _STEP
        return pixels, by_point, by_parameter


class FixedSensor:
    """A camera that is known, as a sensor of `bundle.model` without parameters."""

    def __init__(self, camera: CameraModel) -> None:
        self._known, self._model = parameters_of(camera), camera.distortion_model

    def __call__(self, points_c: Array, parameters: Array) -> tuple[Array, Array, Array]:
        """Pixels (M, 2) of points (M, 3) m, and the derivatives by points (M, 2, 3) and by nothing (M, 2, 0)."""
        return *pixels_and_derivative(points_c, self._known, self._model), np.zeros((len(points_c), 2, 0))


def pixels_and_derivative(points_c: Array, parameters: Array, model: str) -> tuple[Array, Array]:
    """Pixels (M, 2) of points (M, 3) m, and the derivatives (M, 2, 3) by the points."""
    focal, centre, coefficients = parameters[:2], parameters[2:4], parameters[4:]
    depth = points_c[:, 2:]
    ideal = points_c[:, :2] / depth
    distorted, by_ideal = ideal, np.broadcast_to(np.eye(2), (len(ideal), 2, 2))
    if model == EQUIDISTANT or coefficients.any():
        distorted, by_ideal = _with_derivative(ideal, coefficients, model)
    across = focal[:, None] * by_ideal / depth[..., None]
    return focal * distorted + centre, np.concatenate([across, -(across @ ideal[..., None])], -1)
