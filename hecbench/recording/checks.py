"""What the arrays of a recording must be."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.lens import finite
from hecbench.se3 import Array

if TYPE_CHECKING:
    from hecbench.recording.recording import Recording

_ROTATION_TOLERANCE = 1e-3


def checked_arrays(recording: Recording) -> dict[str, Array | None]:
    """Its arrays as floats, rotations on SO(3); those that hold nothing are None.

    Raises:
        InputError: with the name, the value and the cure.
    """
    checked: dict[str, Array | None] = {}
    for name in ("initial_parent_T_camera", "truth_parent_T_camera"):
        if (pose := getattr(recording, name)) is not None:
            checked[name] = _rigid(finite(name, pose, (4, 4))[None], name)[0]
    for name in ("base_T_flange", "camera_T_target"):
        if (poses := _per_sample(recording, name, (4, 4))) is not None:
            poses = _rigid(poses, f"samples[{{}}].{name}")
        checked[name] = poses
    joint_count = 0 if recording.joints_rad is None else np.shape(recording.joints_rad)[-1]
    checked["joints_rad"] = _per_sample(recording, "joints_rad", (joint_count,))
    declared = len(recording.robot.joint_names) if recording.robot else 0
    if declared and checked["joints_rad"] is not None and joint_count != declared:
        raise InputError(f"samples[0].joints_rad: {joint_count} numbers for {declared} robot.joint_names")
    for name in ("robot_stamp_s", "camera_stamp_s"):
        checked[name] = _per_sample(recording, name, ())
    checked["corners_px"] = _corners(recording)
    _every_sample_has_a_robot_pose(len(recording), checked["base_T_flange"], checked["joints_rad"])
    return checked


def _per_sample(recording: Recording, name: str, shape: tuple[int, ...]) -> Array | None:
    """The array of that name with N rows; rows are finite or wholly NaN, all-NaN arrays None."""
    if (value := getattr(recording, name)) is None:
        return None
    array = np.asarray(value, float)
    expected = (len(recording), *shape)
    if array.shape != expected:
        raise InputError(f"{name}: shape {array.shape}, expected {expected}, one row per sample")
    known = np.isfinite(array.reshape(len(recording), -1))
    for i in np.flatnonzero(known.any(1) & ~known.all(1)):
        raise InputError(f"samples[{i}].{name}: holds a number that is not finite; correct or leave it out")
    return array if known.any() else None


def _corners(recording: Recording) -> Array | None:
    if recording.corners_px is None:
        return None
    if recording.target is None:
        raise InputError("samples[0].corners_px: given without a target; describe the target")
    corners = np.asarray(recording.corners_px, float)
    expected = (len(recording), len(recording.target.points_m), 2)
    if corners.shape != expected:
        raise InputError(f"corners_px: shape {corners.shape}, expected {expected}: one row per target point")
    if np.isinf(corners).any() or (np.isnan(corners[..., 0]) != np.isnan(corners[..., 1])).any():
        raise InputError("corners_px: holds a number that is not finite; use null for a point not seen")
    return corners if np.isfinite(corners).any() else None


def _every_sample_has_a_robot_pose(count: int, *arrays: Array | None) -> None:
    known = np.zeros(count, bool)
    for array in arrays:
        if array is not None:
            known |= np.isfinite(array.reshape(count, -1)).all(1)
    for i in np.flatnonzero(~known):
        raise InputError(f"samples[{i}]: has neither base_T_flange nor joints_rad; give at least one")


def _rigid(poses: Array, name: str) -> Array:
    """Check transforms (N, 4, 4), NaN rows allowed, and move rounded rotations onto SO(3).

    `name` is for errors; its {} stands for the sample's index.
    """
    given = ~np.isnan(poses).all((1, 2))
    for i in np.flatnonzero(given & ~se3.is_transform(poses, _ROTATION_TOLERANCE)):
        raise InputError(
            f"{name.format(i)}: is not a rigid transform; write a row-major 4x4 with an orthonormal, "
            "right-handed rotation, metres, and the last row 0 0 0 1"
        )
    rounded = given & ~se3.is_transform(poses, 1e-9)
    if rounded.any():
        poses = poses.copy()
        poses[rounded, :3, :3] = se3.nearest_rotation(poses[rounded, :3, :3])
    return poses
