"""Poses worth recording: the target or the robot in view, within the limits, and telling as much as possible.

With a target: hand-eye calibration needs rotations about different axes (Tsai and Lenz 1989, section on accuracy), so
candidates are drawn in the camera's view and chosen one by one, each the furthest from those already chosen. Without
one the robot's contour tells the camera (`hecbench.next_view`), and candidates are joints around the first sample's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from hecbench import next_view, se3
from hecbench.errors import InputError
from hecbench.recording import CameraModel, Recording, hand_poses
from hecbench.se3 import Array
from hecbench_hardware.clearance import check_motion, check_pose
from hecbench_hardware.kinematics import Arm
from hecbench_hardware.limits import Limits
from hecbench_hardware.motions import JointMotion, six_joints

_CANDIDATES = 3000
_METRES_PER_RADIAN = 0.5
"""How far apart in position counts as much as one radian of rotation when poses are compared."""
MARGIN = 0.05
"""Share of the image at each edge that the target keeps clear of."""


_LOOKS = 300
_WANDER_RAD = np.array([1.5, 0.6, 0.6, 1.2, 1.2, 3.0])
"""How far candidates for views of the robot go from the first sample's joints."""
_HOW = {"initial_parent_T_camera": ", or give it with --init"}


class Criterion(StrEnum):
    """What makes a view of the robot worth recording; see `hecbench.next_view`."""

    D_OPTIMAL = "d_optimal"
    MASK_VARIANCE = "mask_variance"


@dataclass(frozen=True)
class View:
    """From where the target may be seen."""

    nearest: float = 0.7
    furthest: float = 1.3
    """Distances as multiples of the first sample's."""
    tilt_rad: float = 0.7
    """Largest angle between the optical axis and the target's normal."""
    roll_rad: float = 1.5
    """Largest turn about the optical axis."""


def diverse_plan(
    cell: Recording,
    arm: Arm,
    limits: Limits,
    count: int,
    rng: np.random.Generator,
    view: View | None = None,
) -> Recording:
    """A plan of `count` poses around the first sample of a cell.

    Args:
        cell: Describes camera, target and mounting, holds a rough `initial_parent_T_camera`, and in its first
            sample the joints and `camera_T_target` at which the target is seen.
        arm: The arm.
        limits: Every pose and every path between two poses respects them.
        count: How many poses.
        rng: Draws the candidates.
        view: From where.

    Returns:
        The cell with the planned joints and poses as its samples, in driving order, the first sample first.

    Raises:
        InputError: The cell lacks something, or fewer than `count` poses can be reached and seen.
    """
    seen, parent_T_camera, carrier_T_target, start = _seed(cell, arm)
    camera, target = cell.present.camera, cell.present.target
    poses = candidates(seen, view or View(), rng)
    poses = poses[in_view(poses, camera, target.points_m)]
    hand = parent_T_camera @ poses @ se3.inverse(carrier_T_target)
    joints = reachable(hand_poses(cell.mounting, hand), arm, start, limits)
    chosen = [start]
    for pick in _spread(arm.forward(joints), arm.forward(start), len(joints)):
        if len(chosen) == count:
            break
        if free_path(arm, start, joints[pick], limits):
            chosen.append(joints[pick])
    return _toured(cell, np.array(chosen), arm, limits, count)


def informative_plan(
    cell: Recording,
    arm: Arm,
    limits: Limits,
    count: int,
    rng: np.random.Generator,
    criterion: Criterion = Criterion.D_OPTIMAL,
) -> Recording:
    """A plan of `count` poses in which the robot itself tells most about the camera, for cells without a target.

    Candidates are joints drawn evenly around the first sample's, no further than `_WANDER_RAD`: self-collision is not
    modelled, and an arm that is folded as at the start stays clear of itself.

    Args:
        cell: Describes robot model, camera and mounting, holds a rough `initial_parent_T_camera`, and in its first
            sample joints at which the camera sees the robot.
        arm: The arm.
        limits: Every pose and every path between two poses respects them.
        count: How many poses.
        rng: Draws the candidates.
        criterion: What makes a pose worth recording.

    Returns:
        The cell with the planned joints and poses as its samples, in driving order, the first sample first.

    Raises:
        InputError: The cell lacks something, or fewer than `count` poses can be reached and seen.
    """
    _require(
        cell,
        {
            "initial_parent_T_camera": cell.initial_parent_T_camera,
            "samples[0].joints_rad": cell.joints_rad,
        },
    )
    view, start = next_view.RobotView(cell), six_joints(cell.present.joints_rad[0])
    free = free_around(start, _LOOKS, arm, start, limits, rng)
    if len(free) < count:
        raise InputError(
            f"{cell.name}: only {len(free)} of {count} poses can be reached within the limits: ask for fewer, widen"
            " the limits, or start from another pose"
        )
    camera = cell.present.initial_parent_T_camera
    known = next_view.prior_information() + view.look(start, camera).information
    arguments = view, camera, np.array(free), known, count - 1
    if criterion is Criterion.D_OPTIMAL:
        chosen = next_view.most_informative(*arguments)
    else:
        chosen = next_view.most_uncertain(*arguments, rng=rng)
    return _toured(cell, np.vstack([start, chosen.joints_rad]), arm, limits, count)


def _toured(cell: Recording, chosen: Array, arm: Arm, limits: Limits, count: int) -> Recording:
    """The cell with these joints (N, 6) as its samples, in driving order."""
    ordered = _short_tour(chosen, arm, limits)
    if len(ordered) < count:
        raise InputError(
            f"{cell.name}: only {len(ordered)} of {count} poses can be reached and seen within the limits:"
            " ask for fewer, widen the limits, or start from another pose"
        )
    return replace(
        cell,
        sample_ids=tuple(f"{i:06d}" for i in range(count)),
        joints_rad=ordered,
        base_T_flange=arm.forward(ordered),
        camera_T_target=None,
        corners_px=None,
        images=None,
        masks=None,
        robot_stamp_s=None,
        camera_stamp_s=None,
    )


def free_around(
    centre: Array, count: int, arm: Arm, here: Array, limits: Limits, rng: np.random.Generator
) -> list[Array]:
    """Of `count` joints (6,) drawn evenly around some, those to which the arm can move freely from where it is."""
    drawn = centre + rng.uniform(-1, 1, (count, 6)) * _WANDER_RAD
    return [joints for joints in drawn if free_path(arm, here, joints, limits)]


def _require(cell: Recording, needed: Mapping[str, object]) -> None:
    for name, value in needed.items():
        if value is None:
            raise InputError(
                f"{cell.name}: planning needs {name}, roughly; add it to the cell{_HOW.get(name, '')}"
            )


def _seed(cell: Recording, arm: Arm) -> tuple[Array, Array, Array, Array]:
    """camera_T_target, parent_T_camera, carrier_T_target (4, 4) and joints (6,) of the first sample."""
    present = cell.present
    needed = {
        "camera.K": cell.camera and cell.camera.K,
        "target": cell.target,
        "initial_parent_T_camera": cell.initial_parent_T_camera,
        "samples[0].joints_rad": cell.joints_rad,
        "samples[0].camera_T_target": cell.camera_T_target,
    }
    _require(cell, needed)
    start, seen = six_joints(present.joints_rad[0]), present.camera_T_target[0]
    hand = hand_poses(cell.mounting, arm.forward(start))
    return (
        seen,
        present.initial_parent_T_camera,
        se3.inverse(hand) @ present.initial_parent_T_camera @ seen,
        start,
    )


def candidates(seen: Array, view: View, rng: np.random.Generator) -> Array:
    """Target poses (N, 4, 4) in the camera: distance, place in the image, tilt and roll drawn evenly."""
    n = _CANDIDATES
    distance = float(np.linalg.norm(seen[:3, 3])) * rng.uniform(view.nearest, view.furthest, n)
    aside = rng.uniform(-0.6, 0.6, (n, 2))
    position = distance[:, None] * np.column_stack([aside, np.ones(n)]) / np.hypot(1, aside)[:, :1]
    azimuth, tilt = rng.uniform(-np.pi, np.pi, n), view.tilt_rad * np.sqrt(rng.uniform(0, 1, n))
    axis = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.zeros(n)])
    roll = np.column_stack([np.zeros((n, 2)), rng.uniform(-view.roll_rad, view.roll_rad, n)])
    rotation = se3.so3_exp(tilt[:, None] * axis) @ se3.so3_exp(roll) @ _faced(seen[:3, :3])
    return se3.make(rotation, position)


def _faced(camera_R_target: Array) -> Array:
    """The rotation (3, 3) turned the shortest way until the target's normal is along the optical axis."""
    normal = camera_R_target[:, 2]
    axis = np.cross(normal, [0.0, 0.0, 1.0 if normal[2] >= 0 else -1.0])
    sine = float(np.linalg.norm(axis))
    turn = np.arctan2(sine, abs(normal[2])) / max(sine, 1e-12)
    return np.asarray(se3.so3_exp(turn * axis) @ camera_R_target)


def in_view(
    camera_T_target: Array, camera: CameraModel, points_m: Array, margin: float = MARGIN
) -> NDArray[np.bool_]:
    """Which poses (N,) show the whole target, `margin` of the image clear of its edges; distortion is left out."""
    points = se3.transform_points(camera_T_target, points_m)
    projected = points @ camera.intrinsics.T
    depth = np.maximum(projected[..., 2:], 1e-9)
    size = np.array([camera.width, camera.height])
    inside = np.abs(projected[..., :2] / depth / size - 0.5) < 0.5 - margin
    return np.asarray(inside.all(axis=(1, 2)))


def reachable(base_T_flange: Array, arm: Arm, start: Array, limits: Limits) -> Array:
    """The joints (M, 6) nearest to the start of every pose that has some within the limits."""
    found = []
    for pose in base_T_flange:
        for joints in arm.inverse(pose, start)[:2]:
            try:
                check_pose(arm, joints, limits)
            except InputError:
                continue
            found.append(joints)
            break
    return np.array(found).reshape(-1, 6)


def _spread(poses: Array, first: Array, count: int) -> list[int]:
    """Indices of poses (M, 4, 4), each the furthest from the first pose and from those before it."""
    order: list[int] = []
    nearest = apart(poses, first)
    for _ in range(count):
        pick = int(nearest.argmax())
        order.append(pick)
        nearest = np.minimum(nearest, apart(poses, poses[pick]))
    return order


def apart(poses: Array, other: Array) -> Array:
    """How different poses (M, 4, 4) are from another, radians."""
    turn, shift = se3.rotation_error_rad(poses, other), se3.translation_error_m(poses, other)
    return np.asarray(np.hypot(turn, shift / _METRES_PER_RADIAN))


def _short_tour(joints: Array, arm: Arm, limits: Limits) -> Array:
    """The same joints (N, 6), each followed by the nearest one left that it can move to freely."""
    tour, left = [joints[0]], list(joints[1:])
    while left:
        left.sort(key=lambda there: float(np.abs(there - tour[-1]).max()))
        for k, there in enumerate(left):
            if free_path(arm, tour[-1], there, limits):
                tour.append(left.pop(k))
                break
        else:
            break
    return np.array(tour)


def free_path(arm: Arm, start: Array, end: Array, limits: Limits) -> bool:
    try:
        check_motion(arm, JointMotion(arm, start, end), limits)
    except InputError:
        return False
    return True
