"""Rows of numbers as poses: every spelling of a rotation, unit, order and direction that they may be meant in."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from hecbench import se3
from hecbench.errors import InputError
from hecbench.se3 import Array

EULER_ORDERS = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX", "XYX", "XZX", "YXY", "YZY", "ZXZ", "ZYZ")
ROTATIONS = {
    4: ("quat_xyzw", "quat_wxyz"),
    3: ("rotvec", *(f"euler_{order}" for order in EULER_ORDERS + tuple(o.lower() for o in EULER_ORDERS))),
    9: ("matrix", "matrix_transposed"),
}
"""Spellings of a rotation by its count of numbers; Euler orders in capitals turn about the moving axes."""

VENDORS = {
    "ur": "rotvec",
    "kuka": "euler_ZYX",
    "fanuc": "euler_xyz",
    "abb": "quat_wxyz",
    "yaskawa": "euler_xyz",
    "kawasaki": "euler_ZYZ",
    "staubli": "euler_XYZ",
    "franka": "matrix",
    "doosan": "euler_ZYZ",
    "xarm": "euler_xyz",
    "mecademic": "euler_XYZ",
    "epson": "euler_ZYX",
    "denso": "euler_xyz",
}
"""How the controllers write a rotation, as their manuals call it: KUKA A B C, Fanuc W P R, Kawasaki O A T, Epson U V W,
ABB q1 to q4, UR and xArm rx ry rz (xArm also roll pitch yaw). Franka's O_T_EE is column-major, which shows."""

UNITS_M = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
_METRES_BELOW = 10.0
_ARMS_CM_BELOW = 300.0
_SEEN_CM_BELOW = 100.0
"""Centimetres are as usual as millimetres below: of an arm's reach, and of a target before a camera."""
_NO_CENTIMETRES_FROM = 1000.0
_RADIANS_BELOW = 2 * np.pi + 0.1


@dataclass(frozen=True, eq=False)
class PoseConvention:
    """One way to read a stream of poses.

    Attributes:
        poses: (N, 4, 4) m, turned into base_T_flange or camera_T_target.
        text: names it in notes and errors.
        deviations: in how many points it departs from what the format's description, or the user, says.
        unusual: it is worth a try only when no usual reading convinces.
    """

    poses: Array
    text: str
    deviations: int = 0
    unusual: bool = False


def pose_conventions(
    numbers: ArrayLike,
    frames: tuple[str, str],
    *,
    rotation: str | None = None,
    assumed_rotation: str | Sequence[str] | None = None,
    unit: str | None = None,
    inverted: bool | None = None,
    assumed_inverted: bool = False,
) -> list[PoseConvention]:
    """Every reading of rows of numbers: position and rotation, usually in this order, or a 3x4 or 4x4 matrix.

    A matrix is row-major; a 4x4 whose last column is 0 0 0 1 is read as column-major.

    Args:
        numbers: (N, 6 | 7 | 12 | 16), or (N, 4, 4).
        frames: of the pose that is wanted, such as ("base", "flange").
        rotation: a name of `ROTATIONS` or `VENDORS`, when the user says so: the only one tried.
        assumed_rotation: the documented name or names; others count as deviations. None: none is documented.
        unit: "m", "cm" or "mm"; None: by magnitude, since no arm reaches 10 m.
        inverted: whether the numbers are the inverse pose, when the user says so; None tries both.
        assumed_inverted: the documented direction; the other one counts as a deviation.

    Raises:
        InputError: the rows are not of these lengths, or no spelling gives rotations.
    """
    rows = np.asarray(numbers, float)
    rows = rows.reshape(len(rows), -1)
    layouts = list(_layouts(rows))
    rotation = VENDORS.get(str(rotation).lower(), rotation)
    names = ROTATIONS[layouts[0][1].shape[1]]
    if rotation is not None and rotation not in names:
        known = ", ".join((*names, *(vendor for vendor, name in VENDORS.items() if name in names)))
        raise InputError(f"rotation '{rotation}' does not fit {layouts[0][1].shape[1]} numbers: {known}")
    if rows.shape[1] > 7:
        assumed_rotation = assumed_rotation or "matrix"
    assumed = (assumed_rotation,) if isinstance(assumed_rotation, str) else tuple(assumed_rotation or names)
    found, faults = [], []
    for position, turn, order in layouts:
        units = [(unit, 0)] if unit else _units(position, frames[0] == "base")
        for name in (rotation,) if rotation else names:
            try:
                poses = _poses(name, position, turn)
            except InputError as error:
                faults.append(str(error))
                continue
            unusual = rotation is None and name not in assumed
            ways = (False, True) if inverted is None else (inverted,)
            for (length, rare), inverse in product(units, ways):
                a, b = frames[::-1] if inverse else frames
                scaled = poses.copy()
                scaled[:, :3, 3] *= UNITS_M[length]
                text = f"{a}_T_{b} {name} in {length}{order}"
                poses_m = se3.inverse(scaled) if inverse else scaled
                wrong_way = inverted is None and inverse != assumed_inverted
                deviations = unusual + wrong_way + rare + bool(order)
                found.append(PoseConvention(poses_m, text, deviations, unusual=bool(order)))
    if not found:
        raise InputError(faults[0])
    return found


def _layouts(rows: Array) -> Iterator[tuple[Array, Array, str]]:
    """Position (N, 3), rotation (N, 3 | 4 | 9) and what is unusual about their order, most usual first."""
    count = rows.shape[1]
    if count in (12, 16):
        if count == 16 and not rows[:, [3, 7, 11]].any():
            rows = np.swapaxes(rows.reshape(-1, 4, 4), 1, 2).reshape(-1, 16)
        matrices = rows[:, :12].reshape(-1, 3, 4)
        yield matrices[:, :, 3], matrices[:, :, :3].reshape(-1, 9), ""
        if count == 12:
            yield rows[:, 9:], rows[:, :9], ", rotation first"
            yield rows[:, :3], rows[:, 3:], ", position first"
    elif count in (6, 7):
        yield rows[:, :3], rows[:, 3:], ""
        yield rows[:, count - 3 :], rows[:, : count - 3], ", rotation first"
    else:
        raise InputError(
            f"a pose of {count} numbers; expected x y z and 3 or 4 of the rotation, or a 3x4 or 4x4 matrix"
        )


def _units(position: Array, of_arm: bool) -> list[tuple[str, int]]:
    """Units that lengths of this magnitude may be in, and how unusual each is."""
    length = float(np.median(np.linalg.norm(position, axis=1)))
    if length < _METRES_BELOW:
        return [("m", 0)]
    rare = length >= (_ARMS_CM_BELOW if of_arm else _SEEN_CM_BELOW)
    return [("mm", 0), ("cm", int(rare))] if length < _NO_CENTIMETRES_FROM else [("mm", 0)]


def _poses(name: str, position: Array, turn: Array) -> Array:
    """Poses (N, 4, 4) of positions and rotations of that name."""
    matrices = _rotation_matrices(name, turn)
    if (np.linalg.det(matrices) < 0).all():
        raise InputError("its rotations are left-handed (determinant -1): turn one axis round")
    if not se3.is_transform(se3.make(matrices, position), 1e-2).all():
        raise InputError("no pose has a proper rotation; check the order and number of columns")
    return se3.make(se3.nearest_rotation(matrices), position)


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
