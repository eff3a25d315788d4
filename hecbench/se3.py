"""Rigid transforms as (..., 4, 4) float64 arrays named by their frames: ``p_a = a_T_b @ p_b``.

Every function is vectorised over leading axes. Metres and radians throughout. Twists are ``[phi, rho]``,
rotation first; perturbations act from the left, in the parent frame: ``X_true = exp(xi) @ X_est``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_SMALL_ANGLE_RAD = 1e-4
_ROUNDING = 1e-12
"""Entries of R R^T - I below it come from rounding."""


def make(rotation: ArrayLike, translation: ArrayLike) -> Array:
    """Stack rotations (..., 3, 3) and translations (..., 3) m into transforms (..., 4, 4)."""
    rotation, translation = np.asarray(rotation, float), np.asarray(translation, float)
    shape = np.broadcast_shapes(rotation.shape[:-2], translation.shape[:-1])
    a_T_b = np.zeros((*shape, 4, 4))
    a_T_b[..., :3, :3] = rotation
    a_T_b[..., :3, 3] = translation
    a_T_b[..., 3, 3] = 1.0
    return a_T_b


def inverse(a_T_b: ArrayLike) -> Array:
    """b_T_a (..., 4, 4): maps points of a back into b."""
    a_T_b = np.asarray(a_T_b, float)
    b_R_a = np.swapaxes(a_T_b[..., :3, :3], -1, -2)
    return make(b_R_a, -(b_R_a @ a_T_b[..., :3, 3:])[..., 0])


def transform_points(a_T_b: ArrayLike, points_b: ArrayLike) -> Array:
    """Points (..., P, 3) of frame b in frame a, for transforms (..., 4, 4)."""
    a_T_b, points_b = np.asarray(a_T_b, float), np.asarray(points_b, float)
    return np.asarray(points_b @ np.swapaxes(a_T_b[..., :3, :3], -1, -2) + a_T_b[..., None, :3, 3])


def hat(v: ArrayLike) -> Array:
    """Cross-product matrices (..., 3, 3) of vectors (..., 3): ``hat(v) @ w == cross(v, w)``."""
    v = np.asarray(v, float)
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    zero = np.zeros_like(x)
    entries = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1)
    return np.asarray(entries.reshape(*v.shape[:-1], 3, 3))


def so3_exp(rotvec: ArrayLike) -> Array:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3) rad, by way of unit quaternions."""
    half = np.asarray(rotvec, float) / 2
    angle = np.linalg.norm(half, axis=-1, keepdims=True)
    return _from_unit_quat(np.concatenate([half * np.sinc(angle / np.pi), np.cos(angle)], -1))


def so3_log(rotation: ArrayLike) -> Array:
    """Rotation vectors (..., 3) rad, of angle at most pi, of rotation matrices (..., 3, 3)."""
    quaternion = _quat(rotation)
    sine = np.linalg.norm(quaternion[..., :3], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, quaternion[..., 3:])
    return np.asarray(quaternion[..., :3] * np.where(sine > 0, angle / np.where(sine > 0, sine, 1.0), 2.0))


def _from_unit_quat(quaternion: Array) -> Array:
    """Rotation matrices (..., 3, 3) of unit quaternions (..., 4) in the order x, y, z, w."""
    outer = quaternion[..., :, None] * quaternion[..., None, :]
    vector = outer[..., :3, :3]
    scalar = outer[..., 3, 3] - np.trace(vector, axis1=-2, axis2=-1)
    return np.asarray(2 * (vector + hat(outer[..., 3, :3])) + scalar[..., None, None] * np.eye(3))


def _quat(rotation: ArrayLike) -> Array:
    """Unit quaternions (..., 4) in the order x, y, z, w with w >= 0 of rotation matrices (..., 3, 3).

    A matrix gives four multiples of its quaternion, the rows below; the longest is the most exact (Shepperd 1978).
    """
    R = _proper(np.asarray(rotation, float))
    trace = np.trace(R, axis1=-2, axis2=-1)[..., None]
    skew = R - np.swapaxes(R, -1, -2)
    rows = np.empty((*R.shape[:-2], 4, 4))
    rows[..., :3, :3] = R + np.swapaxes(R, -1, -2) + (1 - trace)[..., None] * np.eye(3)
    rows[..., 3, :3] = rows[..., :3, 3] = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], -1)
    rows[..., 3, 3] = 1 + trace[..., 0]
    longest = np.diagonal(rows, axis1=-2, axis2=-1).argmax(-1)[..., None, None]
    quaternion = np.take_along_axis(rows, longest, -2)[..., 0, :]
    length = np.linalg.norm(quaternion, axis=-1, keepdims=True)
    return np.asarray(quaternion / np.where(quaternion[..., 3:] < 0, -length, length))


def _proper(matrix: Array) -> Array:
    """The matrices (..., 3, 3), those that are no rotations to rounding replaced by the nearest ones.

    Raises:
        ValueError: a matrix mirrors or is singular.
        LinAlgError: a matrix is not finite.
    """
    with np.errstate(invalid="ignore"):
        mirrors = np.linalg.det(matrix) <= 0
    if mirrors.any():
        raise ValueError("a rotation matrix with a determinant of 0 or less")
    deviation = np.abs(matrix @ np.swapaxes(matrix, -1, -2) - np.eye(3)).max((-1, -2))
    if (deviation <= _ROUNDING).all():
        return matrix
    return np.where((deviation <= _ROUNDING)[..., None, None], matrix, nearest_rotation(matrix))


def left_jacobian(rotvec: ArrayLike) -> Array:
    """V(phi) (..., 3, 3): ``exp([phi, rho])`` has translation V(phi) rho (Barfoot 2017, eq. 7.37)."""
    rotvec = np.asarray(rotvec, float)
    angle = np.linalg.norm(rotvec, axis=-1)[..., None, None]
    small = angle < _SMALL_ANGLE_RAD
    safe = np.where(small, 1.0, angle)
    first = np.where(small, 0.5 - angle**2 / 24, (1 - np.cos(safe)) / safe**2)
    second = np.where(small, 1 / 6 - angle**2 / 120, (safe - np.sin(safe)) / safe**3)
    cross = hat(rotvec)
    return np.asarray(np.eye(3) + first * cross + second * (cross @ cross))


def exp(twist: ArrayLike) -> Array:
    """Transforms (..., 4, 4) of twists (..., 6) = [phi rad, rho m]."""
    twist = np.asarray(twist, float)
    phi, rho = twist[..., :3], twist[..., 3:]
    return make(so3_exp(phi), (left_jacobian(phi) @ rho[..., None])[..., 0])


def log(a_T_b: ArrayLike) -> Array:
    """Twists (..., 6) = [phi rad, rho m] of transforms (..., 4, 4); inverts `exp` for angles below pi."""
    a_T_b = np.asarray(a_T_b, float)
    phi = so3_log(a_T_b[..., :3, :3])
    rho = np.linalg.solve(left_jacobian(phi), a_T_b[..., :3, 3:])[..., 0]
    return np.concatenate([phi, rho], -1)


def adjoint(a_T_b: ArrayLike) -> Array:
    """Ad (..., 6, 6) with ``a_T_b @ exp(xi) = exp(Ad @ xi) @ a_T_b``: moves a twist from b to a."""
    a_T_b = np.asarray(a_T_b, float)
    rotation = a_T_b[..., :3, :3]
    ad = np.zeros((*a_T_b.shape[:-2], 6, 6))
    ad[..., :3, :3] = ad[..., 3:, 3:] = rotation
    ad[..., 3:, :3] = hat(a_T_b[..., :3, 3]) @ rotation
    return ad


def inverse_covariance(a_T_b: ArrayLike, covariance: ArrayLike) -> Array:
    """Covariance (6, 6) of the left perturbation of inverse(a_T_b), from that of a_T_b itself."""
    carried = adjoint(inverse(a_T_b))
    found = carried @ np.asarray(covariance) @ carried.T
    return np.asarray((found + found.T) / 2)


def nearest_rotation(matrix: ArrayLike) -> Array:
    """The proper rotations nearest to matrices (..., 3, 3) in the Frobenius norm (Kabsch 1976)."""
    u, _, vt = np.linalg.svd(np.asarray(matrix, float))
    u[..., :, 2] *= np.sign(np.linalg.det(u @ vt))[..., None]
    return np.asarray(u @ vt)


def mean(a_T_b: ArrayLike) -> Array:
    """Chordal mean (4, 4) of transforms (N, 4, 4): nearest rotation to the mean matrix, mean translation."""
    a_T_b = np.asarray(a_T_b, float)
    return make(nearest_rotation(a_T_b[:, :3, :3].mean(0)), a_T_b[:, :3, 3].mean(0))


def rotation_angle(rotation: ArrayLike) -> Array:
    """Rotation angles (...,) rad in [0, pi] of rotations (..., 3, 3), accurate at both ends."""
    rotation = np.asarray(rotation, float)
    skew = rotation - np.swapaxes(rotation, -1, -2)
    twice_sine = np.sqrt((skew**2).sum((-1, -2)) / 2)
    return np.asarray(np.arctan2(twice_sine, np.trace(rotation, axis1=-2, axis2=-1) - 1))


def rotation_error_rad(a_T_b: ArrayLike, a_T_c: ArrayLike) -> Array:
    """Geodesic angles (...,) rad between the rotations of two (stacks of) transforms."""
    a_T_b, a_T_c = np.asarray(a_T_b, float), np.asarray(a_T_c, float)
    return rotation_angle(np.swapaxes(a_T_b[..., :3, :3], -1, -2) @ a_T_c[..., :3, :3])


def translation_error_m(a_T_b: ArrayLike, a_T_c: ArrayLike) -> Array:
    """Distances (...,) m between the origins of b and c, both expressed in a."""
    difference = np.asarray(a_T_b, float)[..., :3, 3] - np.asarray(a_T_c, float)[..., :3, 3]
    return np.asarray(np.linalg.norm(difference, axis=-1))


def is_transform(a_T_b: ArrayLike, tolerance: float = 1e-6) -> NDArray[np.bool_]:
    """Whether each (..., 4, 4) is finite and has a proper rotation and the last row 0 0 0 1."""
    a_T_b = np.asarray(a_T_b, float)
    with np.errstate(invalid="ignore", over="ignore"):
        rotation = a_T_b[..., :3, :3]
        deviation = np.abs(rotation @ np.swapaxes(rotation, -1, -2) - np.eye(3)).max((-1, -2))
        deviation = np.maximum(deviation, np.abs(a_T_b[..., 3, :] - [0, 0, 0, 1]).max(-1))
        rigid = (deviation <= tolerance) & (np.linalg.det(rotation) > 0)
    return np.asarray(rigid & np.isfinite(a_T_b).all((-1, -2)))


def looking(eye_m: ArrayLike, aim_m: ArrayLike) -> Array:
    """a_T_camera (4, 4) of an upright camera at a point (3,) m of a, whose z is up, that looks at another.

    Neither may stand straight above the other: there "upright" says nothing.
    """
    eye_m, aim_m = np.asarray(eye_m, float), np.asarray(aim_m, float)
    forward = (aim_m - eye_m) / np.linalg.norm(aim_m - eye_m)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    return make(np.stack([right, np.cross(forward, right), forward], 1), eye_m)


def from_rotvec(rotvec: ArrayLike, translation: ArrayLike) -> Array:
    """Transforms of rotation vectors (..., 3) rad and translations (..., 3) m."""
    return make(so3_exp(rotvec), translation)


def from_quat_xyzw(quaternion: ArrayLike, translation: ArrayLike) -> Array:
    """Transforms of quaternions (..., 4) in the order x, y, z, w (ROS, scipy) and translations (..., 3) m.

    Raises:
        ValueError: a quaternion is zero.
    """
    quaternion = np.asarray(quaternion, float)
    length = np.linalg.norm(quaternion, axis=-1, keepdims=True)
    if (length == 0).any():
        raise ValueError("a quaternion of length zero")
    return make(_from_unit_quat(quaternion / length), translation)


def from_quat_wxyz(quaternion: ArrayLike, translation: ArrayLike) -> Array:
    """Transforms of quaternions (..., 4) in the order w, x, y, z (MuJoCo) and translations (..., 3) m."""
    return from_quat_xyzw(np.roll(np.asarray(quaternion, float), -1, axis=-1), translation)


def to_quat_xyzw(a_T_b: ArrayLike) -> Array:
    """Quaternions (..., 4) in the order x, y, z, w with w >= 0 of transforms (..., 4, 4)."""
    return _quat(np.asarray(a_T_b, float)[..., :3, :3])


def to_quat_wxyz(a_T_b: ArrayLike) -> Array:
    """Quaternions (..., 4) in the order w, x, y, z with w >= 0 of transforms (..., 4, 4)."""
    return np.roll(to_quat_xyzw(a_T_b), 1, axis=-1)


def from_rpy(rpy: ArrayLike) -> Array:
    """Rotation (3, 3) of roll, pitch, yaw (3,) rad about the fixed axes x, y, z, as in URDF; inverts `to_rpy`."""
    roll, pitch, yaw = np.asarray(rpy, float)
    return so3_exp([0, 0, yaw]) @ so3_exp([0, pitch, 0]) @ so3_exp([roll, 0, 0])


def to_rpy(rotation: ArrayLike) -> Array:
    """Roll, pitch, yaw (3,) rad of a rotation (3, 3) about the fixed axes x, y, z, as in URDF.

    At a pitch of 90 degrees, where only the sum or difference of the others is known, yaw is zero.
    """
    from scipy.spatial.transform import Rotation

    rotation = np.asarray(rotation, float)
    pitch = np.arctan2(-rotation[2, 0], np.hypot(rotation[0, 0], rotation[1, 0]))
    if abs(rotation[2, 0]) > 1 - 1e-12:
        roll = np.arctan2(np.sign(pitch) * rotation[0, 1], np.sign(pitch) * rotation[0, 2])
        return np.array([roll, pitch, 0.0])
    return np.asarray(Rotation.from_matrix(rotation).as_euler("xyz"))
