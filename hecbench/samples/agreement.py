"""The one limit above which an answer contradicts the samples it was made from, for solvers, `check` and evaluators.

What counts is where the target is seen: a target pose says much about that, and little about depth and tilt. Data
without a common calibration leave the typical target as far from its prediction as it moved.
"""

from __future__ import annotations

import numpy as np

from hecbench import se3
from hecbench.se3 import Array
from hecbench.system.wording import significant

LARGEST_SHARE = 0.25
"""Of its own motion that a target may be off; good data leave a few per cent, small tags with flips a tenth."""
LARGEST_TURN_SHARE = 0.5
"""Of the hand's rotation; the tilt of small targets is uncertain, so that more may be left."""


def share_left(left: Array, moved: Array) -> float:
    """The typical of what is left (N,) over the typical of how much was moved (N,)."""
    return float(np.median(left)) / max(float(np.median(moved)), 1e-9)


def share_in_view(seen: Array, predicted: Array) -> float:
    """`share_left` of the target as an angle of view.

    Args:
        seen: camera_T_target (N, 4, 4) m.
        predicted: inverse(X) H Y (N, 4, 4) m.
    """
    sights, expected = (
        poses[:, :3, 3] / np.maximum(np.linalg.norm(poses[:, :3, 3], axis=1), 1e-12)[:, None]
        for poses in (seen, predicted)
    )
    return share_left(_angles(sights, expected), _angles(sights, sights.mean(0)))


def contradiction(hand: Array, seen: Array, parent_T_camera: Array, carrier_T_target: Array) -> str | None:
    """Why an answer contradicts its samples, in words; None when it does not.

    Args:
        hand: H (N, 4, 4) m.
        seen: camera_T_target (N, 4, 4) m.
        parent_T_camera: X (4, 4).
        carrier_T_target: Y (4, 4).
    """
    predicted = se3.inverse(parent_T_camera) @ hand @ carrier_T_target
    in_view = share_in_view(seen, predicted)
    turned = se3.rotation_error_rad(hand, se3.mean(hand))
    left_rad = se3.rotation_error_rad(seen, predicted)
    if in_view > LARGEST_SHARE:
        what = f"leaves the typical target {percent(in_view)} of its own motion in the view away from where it was seen"
    elif share_left(left_rad, turned) > LARGEST_TURN_SHARE:
        what = (
            f"leaves the typical target turned by {significant(np.rad2deg(np.median(left_rad)), 3)} deg"
            f" where the hand turned by {significant(np.rad2deg(np.median(turned)), 3)}"
        )
    else:
        return None
    return f"{what}: are the robot poses inverted, the mounting wrong, or poses not of their images?"


def percent(share: float) -> str:
    """A share for a sentence; beyond all bounds only that it is."""
    return f"{100 * share:.0f} %" if share < 10 else "many times"


def _angles(first: Array, second: Array) -> Array:
    """Angles (N,) rad between directions (N, 3) and (N, 3) or (3,)."""
    sines = np.linalg.norm(np.cross(first, second), axis=-1)
    return np.asarray(np.arctan2(sines, (first * second).sum(-1)))
