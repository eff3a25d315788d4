"""A start as a user gives it: a file, numbers, or a place from which the camera looks at the robot."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np

from hecbench import estimate, se3
from hecbench.errors import InputError
from hecbench.recording import Mounting, Recording
from hecbench.se3 import Array
from hecbench.system import files

FORMS = (
    "give a file (an estimate, or JSON of a 4x4 matrix), 'X Y Z ROLL PITCH YAW' (m, rad; end with deg for degrees),"
    " 'X Y Z QX QY QZ QW', or 'looking-at X Y Z' (where the camera stands, m)"
)
_FARTHEST_M = 20.0
"""A camera is nearer to its robot; larger numbers are millimetres."""
_MOST_RAD = 2 * np.pi
_LOOK_M = 0.3
"""Height above the base of what a camera beside an arm usually looks at, where no target or joint says more."""


def start_of(text: str, recording: Recording) -> Array:
    """parent_T_camera (4, 4) m of a start in words for a recording.

    Raises:
        InputError: it is no file and not understood, not of this mounting, or in other units.
    """
    if Path(text).is_file():
        return _from_file(Path(text), recording)
    words = text.replace(",", " ").split()
    if words and words[0] == "looking-at":
        return _looking(_numbers(words[1:], text), text, recording)
    in_degrees = bool(words) and words[-1] == "deg"
    numbers = _numbers(words[:-1] if in_degrees else words, text)
    _refuse_millimetres(numbers[:3], text)
    match len(numbers):
        case 6:
            angles = np.deg2rad(numbers[3:]) if in_degrees else numbers[3:]
            if np.abs(angles).max() > _MOST_RAD:
                raise InputError(
                    f"--init '{text}': an angle is above two pi rad; for degrees end with the word deg"
                )
            return se3.make(se3.from_rpy(angles), numbers[:3])
        case 7:
            if abs(np.linalg.norm(numbers[3:]) - 1) > 1e-2:
                raise InputError(f"--init '{text}': QX QY QZ QW is no unit quaternion")
            return se3.from_quat_xyzw(numbers[3:], numbers[:3])
    raise InputError(f"--init '{text}': {len(numbers)} numbers; {FORMS}")


def _from_file(path: Path, recording: Recording) -> Array:
    try:
        content = msgspec.json.decode(files.read_bytes(path))
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: is no JSON ({error}); {FORMS}") from error
    if isinstance(content, dict) and "schema" in content:
        start = estimate.load(path)
        here, there = (recording.mounting, recording.parent_link), (start.mounting, start.parent_link)
        if start.parent_T_camera is None or here != there:
            raise InputError(
                f"{path}: is {start.status}, {' from '.join(there)}; the recording needs {' from '.join(here)}"
            )
        return start.parent_T_camera
    if isinstance(content, dict):
        content = content.get("parent_T_camera", content.get("matrix"))
    try:
        matrix = np.asarray(content, float)
    except (TypeError, ValueError):
        matrix = np.zeros(0)
    if matrix.shape != (4, 4) or not se3.is_transform(matrix, 1e-3):
        raise InputError(f"{path}: holds no rigid 4x4 matrix parent_T_camera, row by row, metres; {FORMS}")
    _refuse_millimetres(matrix[:3, 3], str(path))
    return se3.make(se3.nearest_rotation(matrix[:3, :3]), matrix[:3, 3])


def _looking(eye_m: Array, text: str, recording: Recording) -> Array:
    """An upright camera at a place that looks at the target's or the robot's usual place."""
    if recording.mounting is not Mounting.EYE_TO_HAND:
        raise InputError(f"--init '{text}': is for a camera beside the robot; {FORMS}")
    if len(eye_m) != 3:
        raise InputError(
            f"--init '{text}': say where the camera stands, as in 'looking-at 1.5 0.2 0.8';"
            " render_gn_free needs no start"
        )
    _refuse_millimetres(eye_m, text)
    aim_m = np.array([0.0, 0.0, _LOOK_M])
    if recording.base_T_flange is not None:
        aim_m = (aim_m + np.nanmean(recording.base_T_flange[:, :3, 3], axis=0)) / 2
    if np.linalg.norm((aim_m - eye_m)[:2]) < 1e-3:
        raise InputError(f"--init '{text}': is straight above the robot, where upright says nothing; {FORMS}")
    return se3.looking(eye_m, aim_m)


def _numbers(words: list[str], text: str) -> Array:
    try:
        numbers = np.array([float(word) for word in words])
    except ValueError:
        raise InputError(f"--init '{text}': is no file that exists, and not numbers; {FORMS}") from None
    if not np.isfinite(numbers).all():
        raise InputError(f"--init '{text}': holds a number that is not finite")
    return numbers


def _refuse_millimetres(translation: Array, text: str) -> None:
    if np.abs(translation).max(initial=0.0) > _FARTHEST_M:
        raise InputError(
            f"--init '{text}': is {np.abs(translation).max():.0f} m away; write metres, not millimetres"
        )
