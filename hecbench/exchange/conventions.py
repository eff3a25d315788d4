"""Which reading of somebody's pose numbers is right: direction, unit, quaternion or Euler order, mounting.

A right reading makes the target stand still: with H the hand poses and C = camera_T_target there are
constant X and Y with ``C = inverse(X) @ H @ Y``, so the target pose seen through the calibration does not
move. A wrong one makes it move as much as the data do. `prove` fits every reading and keeps the one that
holds still.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import Mounting

Array = NDArray[np.float64]

HINTS_NAME = "hecbench-import.yaml"
"""The file beside other people's data that says what they do not (docs/adapters.md)."""

_CURE = f"write which is meant (mounting, robot_pose, target_pose ...) into {HINTS_NAME} beside it"

EULER_ORDERS = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX", "XYX", "XZX", "YXY", "YZY", "ZXZ", "ZYZ")
ROTATIONS = {
    4: ("quat_xyzw", "quat_wxyz"),
    3: ("rotvec", *(f"euler_{order}" for order in EULER_ORDERS + tuple(o.lower() for o in EULER_ORDERS))),
    9: ("matrix", "matrix_transposed"),
}
"""Spellings of a rotation by its count of numbers; Euler orders in capitals turn about the moving axes."""

_METRES_BELOW = 10.0
_RADIANS_BELOW = 2 * np.pi + 0.1
_STILL = 0.3
_CLEARLY_WORSE = 3.0
_LEAST_SAMPLES = 5
_MOST_FITTED = 40
_ANGLE_SLACK_RAD = np.deg2rad(3.0)


@dataclass(frozen=True, eq=False)
class Reading:
    """One way to read a stream of poses.

    Attributes:
        poses: (N, 4, 4) m, turned into base_T_flange or camera_T_target.
        text: names it in notes and errors.
        deviations: in how many points it departs from what the format's description, or the user, says.
    """

    poses: Array
    text: str
    deviations: int = 0


@dataclass(frozen=True)
class Stillness:
    """Rms deviations of the target's constant pose, and relative to how much the data move."""

    rotation_deg: float
    translation_mm: float
    relative: float

    def __str__(self) -> str:
        return f"{self.rotation_deg:.3g} deg, {self.translation_mm:.3g} mm"


@dataclass(frozen=True, eq=False)
class Proof:
    """The reading that was chosen; `note` says which, how still it holds the target, and what was refused."""

    mounting: Mounting
    base_T_flange: Array
    camera_T_target: Array
    note: str


@dataclass(frozen=True, eq=False)
class _Candidate:
    mounting: Mounting
    robot: Reading
    target: Reading
    deviations: int
    stillness: Stillness

    def __str__(self) -> str:
        return f"{self.name} ({self.stillness})"

    @property
    def name(self) -> str:
        return f"{self.mounting}, {self.robot.text}, {self.target.text}"

    @property
    def sees_target(self) -> bool:
        return bool(np.median(self.target.poses[:, 2, 3]) > 0)


def readings(
    numbers: ArrayLike,
    frames: tuple[str, str],
    *,
    rotation: str | None = None,
    assumed_rotation: str | None = None,
    unit: str | None = None,
    inverted: bool | None = None,
    assumed_inverted: bool = False,
) -> list[Reading]:
    """Every reading of rows of numbers: position first, then the rotation, or a 3x4 or 4x4 matrix.

    A matrix is row-major; a 4x4 whose last column is 0 0 0 1 is read as column-major.

    Args:
        numbers: (N, 6 | 7 | 12 | 16), or (N, 4, 4).
        frames: of the pose that is wanted, such as ("base", "flange").
        rotation: a name of `ROTATIONS`, when the user says so: the only one tried.
        assumed_rotation: the documented name; others count as deviations. None: none is documented.
        unit: "m" or "mm"; None: by magnitude, since no arm reaches 10 m.
        inverted: whether the numbers are the inverse pose, when the user says so; None tries both.
        assumed_inverted: the documented direction; the other one counts as a deviation.

    Raises:
        InputError: the rows are not of these lengths, or the quaternions are not of unit length.
    """
    rows = np.asarray(numbers, float)
    rows = rows.reshape(len(rows), -1)
    if rows.shape[1] in (12, 16):
        if rows.shape[1] == 16 and not rows[:, [3, 7, 11]].any():
            rows = np.swapaxes(rows.reshape(-1, 4, 4), 1, 2).reshape(-1, 16)
        matrices = rows[:, :12].reshape(-1, 3, 4)
        position, turn = matrices[:, :, 3], matrices[:, :, :3].reshape(-1, 9)
        assumed_rotation = assumed_rotation or "matrix"
    else:
        position, turn = rows[:, :3], rows[:, 3:]
    names = ROTATIONS.get(turn.shape[1], ())
    if not names:
        raise InputError(
            f"a pose of {rows.shape[1]} numbers; expected x y z and 3 or 4 of the rotation, or a 4x4 matrix"
        )
    if rotation is not None and rotation not in names:
        raise InputError(f"rotation '{rotation}' does not fit {turn.shape[1]} numbers: {', '.join(names)}")
    unit = unit or ("m" if np.median(np.linalg.norm(position, axis=1)) < _METRES_BELOW else "mm")
    position = position * {"m": 1.0, "mm": 1e-3}[unit]
    found = []
    for name in (rotation,) if rotation else names:
        matrices = _rotation_matrices(name, turn)
        poses = se3.make(matrices, position)
        if not se3.is_transform(poses, 1e-2).all():
            continue
        poses = se3.make(se3.nearest_rotation(matrices), position)
        unusual = rotation is None and assumed_rotation not in (None, name)
        for inverse in (False, True) if inverted is None else (inverted,):
            a, b = frames[::-1] if inverse else frames
            found.append(
                Reading(
                    se3.inverse(poses) if inverse else poses,
                    f"{a}_T_{b} {name} in {unit}",
                    int(unusual) + int(inverted is None and inverse != assumed_inverted),
                )
            )
    if not found:
        raise InputError("no pose has a proper rotation; check the order and number of columns")
    return found


def _rotation_matrices(name: str, turn: Array) -> Array:
    """Rotations (N, 3, 3) of their numbers (N, 3 | 4 | 9) by name; angles above 2 pi are degrees."""
    from scipy.spatial.transform import Rotation

    if name.startswith("matrix"):
        matrices = turn.reshape(-1, 3, 3)
        return matrices if name == "matrix" else np.swapaxes(matrices, 1, 2)
    if name.startswith("quat"):
        if (np.abs(np.linalg.norm(turn, axis=1) - 1) > 1e-2).any():
            raise InputError("a quaternion is not of unit length; check the order of the columns")
        ordered = turn if name == "quat_xyzw" else np.roll(turn, -1, axis=1)
        return np.asarray(Rotation.from_quat(ordered).as_matrix())
    radians = turn if np.abs(turn).max() < _RADIANS_BELOW else np.deg2rad(turn)
    if name == "rotvec":
        return se3.so3_exp(radians)
    return np.asarray(Rotation.from_euler(name.removeprefix("euler_"), radians).as_matrix())


def prove(
    source: str,
    robot: Sequence[Reading],
    target: Sequence[Reading],
    mountings: Sequence[Mounting],
    told: bool = False,
) -> Proof:
    """The one combination of readings that holds the target still; documented readings go first.

    Args:
        source: names the data in notes and errors.
        robot: readings as base_T_flange (N, 4, 4).
        target: readings as camera_T_target (N, 4, 4).
        mountings: the documented or possible ones; the others count as deviations.
        told: the user vouches for the mounting; no other is tried.

    Raises:
        InputError: several readings hold it equally still (all are listed), or none is documented and none
            holds it still.
    """
    count = len(robot[0].poses)
    if count != len(target[0].poses):
        raise InputError(
            f"{source}: {count} robot poses for {len(target[0].poses)} target poses; pair them up"
        )
    candidates = list(_candidates(robot, target, mountings, told))
    documented = [c for c in candidates if c.deviations == 0]
    if count < _LEAST_SAMPLES:
        if len(documented) != 1:
            raise InputError(
                f"{source}: {count} samples cannot tell {len(documented)} possible readings apart; it takes "
                f"{_LEAST_SAMPLES}, or {_CURE}"
            )
        return _proof(documented[0], f"{source}: read as {documented[0].name}; too few samples to prove it")
    limit = min(_STILL, _CLEARLY_WORSE * min(c.stillness.relative for c in candidates) + 0.01)
    still = [c for c in candidates if c.stillness.relative <= limit]
    fitting = [c for c in still if c.deviations == min(s.deviations for s in still)]
    if len(fitting) > 1:
        fitting = [c for c in fitting if c.sees_target] or fitting
    if len(fitting) > 1:
        raise InputError(
            f"{source}: {len(fitting)} readings hold the target equally still: "
            f"{'; '.join(map(str, fitting[:6]))}; {_CURE}"
        )
    if fitting:
        best = fitting[0]
        note = f"{source}: read as {best.name}, which holds the target still to {best.stillness}"
        if not best.sees_target:
            note += " but puts it behind the camera"
        if best.deviations and documented:
            usual = min(documented, key=lambda c: c.stillness.relative)
            note += f"; the documented reading does not: {usual}"
        return _proof(best, note)
    ranked = sorted(candidates, key=lambda c: c.stillness.relative)
    if len(documented) == 1:
        note = f"{source}: read as documented, {documented[0]}; no reading holds the target still, "
        return _proof(documented[0], note + f"the best is {ranked[0]}: pairs mixed up, or too little motion?")
    raise InputError(
        f"{source}: no reading holds the target still; the best are {'; '.join(map(str, ranked[:3]))}; "
        f"check the pairing of robot and target poses, or {_CURE}"
    )


def _proof(chosen: _Candidate, note: str) -> Proof:
    return Proof(chosen.mounting, chosen.robot.poses, chosen.target.poses, note)


def _candidates(
    robot: Sequence[Reading], target: Sequence[Reading], mountings: Sequence[Mounting], told: bool
) -> Iterator[_Candidate]:
    """Combinations worth fitting: rotations must turn by the same angles whatever the directions are."""
    robot_angles = [_turns(reading.poses) for reading in robot]
    target_angles = [_turns(reading.poses) for reading in target]
    pairs = list(product(range(len(robot)), range(len(target))))
    gaps = [float(np.sqrt(np.mean((robot_angles[i] - target_angles[j]) ** 2))) for i, j in pairs]
    limit = _CLEARLY_WORSE * min(gaps) + _ANGLE_SLACK_RAD
    departures = [robot[i].deviations + target[j].deviations for i, j in pairs]
    for (i, j), gap, deviations in zip(pairs, gaps, departures, strict=True):
        the_documented_one = deviations == 0 and departures.count(0) == 1
        if gap > limit and not the_documented_one:
            continue
        for mounting in mountings if told else Mounting:
            flange_poses = robot[i].poses
            hand = flange_poses if mounting is Mounting.EYE_TO_HAND else se3.inverse(flange_poses)
            still = stillness(hand, target[j].poses)
            yield _Candidate(mounting, robot[i], target[j], deviations + (mounting not in mountings), still)


def _turns(poses: Array) -> Array:
    """Angles (N - 1,) rad between neighbouring poses; the inverse poses have the same."""
    if len(poses) < 2:
        return np.zeros(1)
    return np.asarray(se3.rotation_error_rad(poses[:-1], poses[1:]))


def stillness(hand: Array, camera_T_target: Array) -> Stillness:
    """How still the best constant X and Y hold the target, for hand poses (N, 4, 4) m.

    Relative is the larger of how still the target stands for the robot and how still the camera does, so
    that turning both streams round changes nothing. X by Park and Martin 1994, eq. 12 and 20, over all pairs
    of at most 40 samples.
    """
    chosen = np.unique(np.linspace(0, len(hand) - 1, min(len(hand), _MOST_FITTED)).astype(int))
    i, j = np.triu_indices(len(chosen), 1)
    inverse_hand = se3.inverse(hand)
    A = hand[chosen][j] @ inverse_hand[chosen][i]
    B = camera_T_target[chosen][j] @ se3.inverse(camera_T_target[chosen][i])
    turns_A, turns_B = se3.so3_log(A[:, :3, :3]), se3.so3_log(B[:, :3, :3])
    rotation = se3.nearest_rotation(turns_A.T @ turns_B)
    left = (A[:, :3, :3] - np.eye(3)).reshape(-1, 3)
    right = (B[:, :3, 3] @ rotation.T - A[:, :3, 3]).ravel()
    translation = np.linalg.lstsq(left, right, rcond=None)[0] if len(left) else np.zeros(3)
    target_T_camera = se3.inverse(camera_T_target)
    carrier_T_target = inverse_hand @ se3.make(rotation, translation) @ camera_T_target
    parent_T_camera = hand @ se3.mean(carrier_T_target) @ target_T_camera
    angle, distance = _rms_deviations(carrier_T_target)
    relative = max(
        deviation / max(extent, 1e-9)
        for constant, moving in ((carrier_T_target, camera_T_target), (parent_T_camera, target_T_camera))
        for deviation, extent in zip(_rms_deviations(constant), _rms_deviations(moving), strict=True)
    )
    return Stillness(float(np.rad2deg(angle)), 1e3 * distance, relative)


def _rms_deviations(poses: Array) -> tuple[float, float]:
    """Rms deviations (rad, m) of poses (N, 4, 4) from their chordal mean."""
    mean = se3.mean(poses)
    angles, distances = se3.rotation_error_rad(mean, poses), se3.translation_error_m(mean, poses)
    return float(np.sqrt(np.mean(angles**2))), float(np.sqrt(np.mean(distances**2)))
