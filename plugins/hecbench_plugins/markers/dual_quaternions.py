"""Unit dual quaternions of rigid motions and the matrices of their products, scalar first.

``q + eps q'`` with ``q' = (0, t) q / 2``; a motion equation ``a x = x b`` is linear in ``x`` through the
matrices of the left and of the right product.
"""

from __future__ import annotations

import numpy as np

from hecbench import se3
from hecbench.se3 import Array


def left_matrix(q: Array) -> Array:
    """(..., 4, 4) with ``left_matrix(p) @ q`` the quaternion product ``p q``."""
    return _product_matrix(q, 1.0)


def right_matrix(q: Array) -> Array:
    """(..., 4, 4) with ``right_matrix(q) @ p`` the quaternion product ``p q``."""
    return _product_matrix(q, -1.0)


def _product_matrix(q: Array, sign: float) -> Array:
    matrix = np.zeros((*q.shape[:-1], 4, 4))
    matrix[..., 1:, 1:] = sign * se3.hat(q[..., 1:]) + q[..., :1, None] * np.eye(3)
    matrix[..., 0, 0] = q[..., 0]
    matrix[..., 1:, 0], matrix[..., 0, 1:] = q[..., 1:], -q[..., 1:]
    return matrix


def from_transform(a_T_b: Array) -> tuple[Array, Array]:
    """Real and dual parts, each (..., 4), the real part's scalar not negative."""
    real = se3.to_quat_wxyz(a_T_b)
    return real, _dual_part(real, a_T_b[..., :3, 3])


def _dual_part(real: Array, translation: Array) -> Array:
    pure = np.concatenate([np.zeros((*translation.shape[:-1], 1)), translation], -1)
    return np.asarray((left_matrix(pure) @ real[..., None])[..., 0] / 2)


def to_transform(real: Array, dual: Array) -> Array:
    """a_T_b (4, 4) of a dual quaternion with ``|real| = 1`` and ``real . dual = 0``."""
    conjugate = real * [1.0, -1.0, -1.0, -1.0]
    return se3.from_quat_wxyz(real, 2 * (right_matrix(conjugate) @ dual)[1:])


def motion_equations(A: Array, B: Array) -> Array:
    """(P, 8, 8): zero when applied to (x, x') of X, for motions (P, 4, 4) with ``A X = X B``."""
    (a, a_dual), (b, b_dual) = from_transform(A), from_transform(B)
    equations = np.zeros((len(A), 8, 8))
    equations[:, :4, :4] = equations[:, 4:, 4:] = left_matrix(a) - right_matrix(b)
    equations[:, 4:, :4] = left_matrix(a_dual) - right_matrix(b_dual)
    return equations


def unit_combination(first: Array, second: Array) -> tuple[Array, Array]:
    """The unit dual quaternion in the plane of two vectors (8,); Daniilidis 1999, eq. 33-35.

    With ``s first + second``, ``x . x' = 0`` is a quadratic in s; of its roots the one with the larger real
    part before scaling. A negative discriminant, which only noise gives, counts as zero.
    """
    (u1, w1), (u2, w2) = (first[:4], first[4:]), (second[:4], second[4:])
    quadratic, linear, constant = u1 @ w1, u1 @ w2 + u2 @ w1, u2 @ w2
    root = np.sqrt(np.maximum(linear**2 - 4 * quadratic * constant, 0.0))
    stable = -(linear + (root if linear >= 0 else -root)) / 2
    # the roots are stable / quadratic and constant / stable; as pairs (s, weight of second) neither divides
    options = [np.array([stable, quadratic]), np.array([constant, stable])]
    candidates = [
        (s * first + weight * second) / np.hypot(s, weight)
        for s, weight in options
        if np.hypot(s, weight) > 0
    ] or [first, second]
    best: Array = max(candidates, key=lambda z: float(z[:4] @ z[:4]))
    best = best / np.linalg.norm(best[:4])
    return best[:4], best[4:] - (best[:4] @ best[4:]) * best[:4]
