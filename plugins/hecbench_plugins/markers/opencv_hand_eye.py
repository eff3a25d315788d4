"""OpenCV's closed forms behind one model, float64 in and out, and the choice of samples that they need.

The mapping of both mountings onto OpenCV's arguments was verified on exact data: with G = inverse(H),
``calibrateHandEye`` takes G and camera_T_target and returns X; ``calibrateRobotWorldHandEye`` takes
camera_T_target and H and returns inverse(Y) and inverse(X).
"""

from __future__ import annotations

import numpy as np

from hecbench import se3
from hecbench.errors import Refusal
from hecbench.se3 import Array
from hecbench_plugins.markers.hand_eye import PosedSamples, require_two_rotation_axes


def hand_eye(pairs: PosedSamples, method: int) -> Array:
    """X (4, 4) by one of cv2.CALIB_HAND_EYE_*, on the motions between the samples compared.

    Raises:
        Refusal: OpenCV gave nothing finite.
    """
    import cv2

    G, C = se3.inverse(pairs.compared.hand), pairs.compared.camera_T_target
    try:
        rotation, translation = cv2.calibrateHandEye(*_split(G), *_split(C), method=method)
    except cv2.error as error:
        raise Refusal(f"OpenCV could not solve the equations: {error.err}") from error
    return _finite(se3.make(rotation, translation[:, 0]))


def robot_world(pairs: PosedSamples, method: int) -> tuple[Array, Array]:
    """X and Y, each (4, 4), by one of cv2.CALIB_ROBOT_WORLD_HAND_EYE_*.

    Raises:
        Refusal: OpenCV gave nothing finite.
    """
    import cv2

    H, C = pairs.hand, pairs.camera_T_target
    try:
        R_target, t_target, R_camera, t_camera = cv2.calibrateRobotWorldHandEye(
            *_split(C), *_split(H), method=method
        )
    except cv2.error as error:
        raise Refusal(f"OpenCV could not solve the equations: {error.err}") from error
    parent_T_camera = se3.inverse(_finite(se3.make(R_camera, t_camera[:, 0])))
    carrier_T_target = se3.inverse(_finite(se3.make(R_target, t_target[:, 0])))
    return parent_T_camera, carrier_T_target


def _split(a_T_b: Array) -> tuple[list[Array], list[Array]]:
    return list(a_T_b[:, :3, :3]), list(a_T_b[:, :3, 3])


def _finite(a_T_b: Array) -> Array:
    if not np.isfinite(a_T_b).all():
        raise Refusal("the equations are singular on this recording: OpenCV's answer is not finite")
    return a_T_b


def without_half_turns(pairs: PosedSamples) -> PosedSamples:
    """The samples among which no two are half a turn apart, within the noise; fewest dropped, greedily.

    A rotation quaternion's sign is fixed by its real part, which vanishes at 180 deg: there noise gives A and
    B opposite signs, and one such pair spoils the whole least-squares problem.

    Raises:
        Refusal: what is left does not determine X.
    """
    pairs = pairs.compared
    angles = np.rad2deg(np.linalg.norm(pairs.rotation_logs, axis=-1))
    margin_deg = max(1.0, 6.0 * float(np.median(np.abs(angles[0] - angles[1]))))
    i, j = np.triu_indices(len(pairs), 1)
    closeness = np.zeros((len(pairs), len(pairs)))
    closeness[i, j] = closeness[j, i] = np.maximum(margin_deg - (180.0 - angles.max(0)), 0.0)
    kept = np.ones(len(pairs), bool)
    while (closeness[kept][:, kept] > 0).any():
        inside = closeness * kept * kept[:, None]
        worst = max(np.flatnonzero(kept), key=lambda k: ((inside[k] > 0).sum(), inside[k].sum()))
        kept[worst] = False
    if kept.all():
        return pairs
    chosen = pairs.subset(np.flatnonzero(kept))
    try:
        require_two_rotation_axes(chosen)
    except Refusal as error:
        raise Refusal(f"without the samples that lie half a turn apart, {error}") from error
    return chosen
