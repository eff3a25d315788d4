"""Where to go next: joints or a pose of the target that differ most from what is recorded, and how to say it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hecbench import next_view, se3
from hecbench.errors import InputError
from hecbench.recording import Mounting, Recording, hand_poses
from hecbench.se3 import Array
from hecbench_hardware.kinematics import JOINT_NAMES, Arm
from hecbench_hardware.limits import Limits
from hecbench_hardware.recorder import poses

_VIEW = poses.View(nearest=0.75, furthest=1.15, tilt_rad=0.5, roll_rad=0.6)
"""Of the target, from where hands and wrists reach without a detour."""
_CAREFUL = poses.View(nearest=0.85, furthest=1.1, tilt_rad=0.4, roll_rad=0.5)
_ROUGH_MARGIN = 0.2
"""Of the picture, kept clear at each edge."""
_DIFFERENT = 0.6
"""Of the largest difference from all samples that is possible: enough of it, at a short way."""
_LOOKS = 40
"""Candidates that are drawn for one suggestion; a plan draws more."""
_LEAST_M, _LEAST_DEG = 0.02, 5.0
"""Smaller moves are not worth a word."""
_MOST_TURNS = 2


@dataclass(frozen=True, eq=False)
class Suggestion:
    """The next pose.

    Attributes:
        joints_rad: (6,), None where the arm's kinematics are not known.
        camera_T_target: (4, 4) m as the target would be seen, None for a cell without one.
    """

    joints_rad: Array | None
    camera_T_target: Array | None


@dataclass(frozen=True, eq=False)
class Reach:
    """An arm, where it stands and what it may do."""

    arm: Arm
    limits: Limits
    here_rad: Array


def of_target(
    cell: Recording,
    parent_T_camera: Array,
    seen: tuple[Array, Array],
    taken: Array,
    here: Array,
    reach: Reach | None,
    rng: np.random.Generator,
    rough: bool,
) -> Suggestion | None:
    """A pose of the target in view that differs from all those taken, near to where the hand is; None: there is none.

    Args:
        cell: its mounting, camera (K known) and target.
        parent_T_camera: the calibration so far, roughly.
        seen: base_T_flange and camera_T_target (4, 4) of one sample.
        taken: base_T_flange (N, 4, 4) of all samples.
        here: base_T_flange (4, 4) now.
        reach: of the arm; None: it is not known.
        rng: draws the candidates.
        rough: the calibration is a guess by eye: smaller steps, well inside the picture.
    """
    wanted = poses.candidates(seen[1], _CAREFUL if rough else _VIEW, rng)
    margin = _ROUGH_MARGIN if rough else poses.MARGIN
    wanted = wanted[poses.in_view(wanted, cell.present.camera, cell.present.target.points_m, margin)]
    carrier_T_target = se3.inverse(hand_poses(cell.mounting, seen[0])) @ parent_T_camera @ seen[1]
    flange = hand_poses(cell.mounting, parent_T_camera @ wanted @ se3.inverse(carrier_T_target))
    apart = np.min([poses.apart(flange, pose) for pose in taken], axis=0)
    free = _clear_of_walls(cell, parent_T_camera @ wanted, reach)
    different = np.flatnonzero(free & (apart >= _DIFFERENT * apart[free].max(initial=0.0)))
    for pick in different[np.argsort(poses.apart(flange[different], here))]:
        if reach is None:
            return Suggestion(None, wanted[pick])
        for joints in poses.reachable(flange[pick][None], reach.arm, reach.here_rad, reach.limits):
            if poses.free_path(reach.arm, reach.here_rad, joints, reach.limits):
                return Suggestion(joints, wanted[pick])
    return None


def _clear_of_walls(cell: Recording, parent_T_target: Array, reach: Reach | None) -> NDArray[np.bool_]:
    """Which poses (N, 4, 4) of a target that the arm carries keep it inside the workspace."""
    if reach is None or cell.mounting is not Mounting.EYE_TO_HAND:
        return np.ones(len(parent_T_target), bool)
    points = se3.transform_points(parent_T_target, cell.present.target.points_m)
    box = reach.limits.workspace
    return np.asarray(((points > box.lower_m) & (points < box.upper_m)).all((1, 2)))


def of_robot(
    view: next_view.RobotView,
    parent_T_camera: Array,
    taken_rad: Array,
    reach: Reach,
    rng: np.random.Generator,
) -> Suggestion | None:
    """The joints near those recorded (N, 6) whose view tells most beside them (D-optimal); None: there are none."""
    known = next_view.prior_information()
    for joints in taken_rad:
        known = known + view.look(joints, parent_T_camera).information
    free = _around(taken_rad[0], reach, rng)
    try:
        chosen = next_view.most_informative(view, parent_T_camera, np.array(free).reshape(-1, 6), known)
    except InputError:  # none of them shows enough of the robot
        return None
    return Suggestion(chosen.joints_rad[0], None)


def unlike(taken_rad: Array, reach: Reach, rng: np.random.Generator) -> Suggestion | None:
    """The joints near those recorded (N, 6) that differ most from them, where nothing is known of the camera."""
    free = _around(taken_rad[0], reach, rng)
    if not free:
        return None
    apart = np.abs(np.array(free)[:, None] - taken_rad).max(-1).min(1)
    return Suggestion(free[int(apart.argmax())], None)


def _around(centre_rad: Array, reach: Reach, rng: np.random.Generator) -> list[Array]:
    return poses.free_around(centre_rad, _LOOKS, reach.arm, reach.here_rad, reach.limits, rng)


def target_words(now: Array | None, wanted: Array) -> str:
    """How the target should appear in the camera, from where it is now (4, 4) to where it is wanted (4, 4)."""
    if now is None:
        return f"show the target {np.linalg.norm(wanted[:3, 3]):.2f} m away, {_part(wanted[:3, 3])}"
    move = wanted[:3, 3] - now[:3, 3]
    said = [
        f"{100 * abs(length):.0f} cm {words[int(length > 0)]}"
        for length, words in zip(
            move, (("left", "right"), ("up", "down"), ("nearer", "farther")), strict=True
        )
        if abs(length) >= _LEAST_M
    ]
    turn = np.rad2deg(se3.so3_log(wanted[:3, :3] @ now[:3, :3].T))
    for axis in np.argsort(-np.abs(turn))[:_MOST_TURNS]:
        if abs(turn[axis]) >= _LEAST_DEG:
            said.append(f"{_TURNS[axis][int(turn[axis] > 0)]} by {abs(turn[axis]):.0f} deg")
    return "as the camera sees it, move the target " + ", ".join(said) if said else "hold the target there"


_TURNS = (
    ("its bottom towards the camera", "its top towards the camera"),
    ("its left side towards the camera", "its right side towards the camera"),
    ("turned anticlockwise", "turned clockwise"),
)
"""Of a negative and a positive rotation about the camera's x (right), y (down) and z (forward)."""


def _part(position: Array) -> str:
    across, down = position[:2] / position[2]
    row = "upper" if down < -0.1 else "lower" if down > 0.1 else "middle"
    column = "left" if across < -0.1 else "right" if across > 0.1 else "middle"
    return "in the middle" if row == column else f"in the {row} {column} part of the picture"


def joint_words(here_rad: Array, wanted_rad: Array) -> str:
    """Which joints to turn, and by how much."""
    turn = np.rad2deg(wanted_rad - here_rad)
    said = [
        f"{name.removesuffix('_joint').replace('_', ' ')} {degrees:+.0f} deg"
        for name, degrees in zip(JOINT_NAMES, turn, strict=True)
        if abs(degrees) >= 1.0
    ]
    return "turn " + ", ".join(said) if said else "stay there"
