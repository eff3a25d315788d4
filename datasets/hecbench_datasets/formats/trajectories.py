"""Two time-stamped trajectories: CSV of ethz hand_eye_calibration and Kalibr (t, x y z, qx qy qz qw), or TUM.

The files' names say which is the robot's. As both describe them, the robot's is base_T_hand and the camera's
target_T_camera, camera on the hand. The clocks may differ: the offset is where the turning speeds of the two
correlate best, and the robot's poses are interpolated at the camera's stamps.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path, PurePosixPath

import numpy as np

from hecbench.errors import InputError
from hecbench.exchange.conventions import HINTS_NAME
from hecbench.recording import Mounting, Recording
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import DatasetSpec
from hecbench.system.wording import significant
from hecbench_datasets.reading.hints import Hints, hints_for
from hecbench_datasets.reading.pairing import Documented, paired
from hecbench_datasets.reading.sources import files_in, foreign, head, table, text, zip_bytes, zip_names
from hecbench_datasets.reading.streams import clock_units, in_seconds, interpolate, lag_s, time_offset_s

MOST_SAMPLES = 160
"""A stream is thinned evenly to about so many pairs: neighbours at camera rate repeat each other."""

_ROBOT = re.compile(r"hand|robot|flange|gripper|effector|tool|base_ee", re.IGNORECASE)
_CAMERA = re.compile(r"cam|eye|target|marker|tag|board|tracking", re.IGNORECASE)
_SUFFIXES = (".csv", ".txt", ".tum")
_LONGEST_S = 1e5


def _streams(path: Path) -> tuple[tuple[Path, str], tuple[Path, str]] | None:
    """(file, "") or (archive, name inside) of the robot's and of the camera's stream."""
    if path.is_dir():
        places = [(file, "") for file in files_in(path, *_SUFFIXES)]
        if not places:
            archives = files_in(path, ".zip")
            places = [(file, name) for file in archives[:1] for name in zip_names(file)]
    else:
        places = [(path, name) for name in zip_names(path)] if path.suffix == ".zip" else []
    places = [place for place in places if _name(place).suffix in _SUFFIXES]
    camera = [place for place in places if _CAMERA.search(_own(place, places))]
    robot = [place for place in places if _ROBOT.search(_own(place, places)) and place not in camera]
    return (robot[0], camera[0]) if len(robot) == len(camera) == 1 else None


def _name(place: tuple[Path, str]) -> PurePosixPath:
    return PurePosixPath(place[1] or place[0].name)


def _own(place: tuple[Path, str], places: list[tuple[Path, str]]) -> str:
    """The part of the file's name that the others do not share."""
    names = [_name(other).stem for other in places]
    shared = 0
    while len(names) > 1 and len({name[: shared + 1] for name in names}) == 1 and shared < len(names[0]):
        shared += 1
    return _name(place).stem[shared:]


def sniff(path: Path) -> bool:
    """A folder or archive with one robot and one camera stream of eight numbers a row, the first no mere counter."""
    found = _streams(path)
    if found is None:
        return False
    counters = 0
    for file, name in found:
        try:
            content = zip_bytes(file, name)[:4096].decode("utf-8", "replace") if name else head(file)
        except InputError:
            return False
        rows = [line for line in content.splitlines()[:-1] if line.strip() and not line.startswith("#")]
        words = [re.split(r"[\s,;]+", row.strip()) for row in rows]
        if not rows or len(words[-1]) != 8:
            return False
        counters += _counted([row[0] for row in words if len(row) == 8])
    return counters < len(found)


def _counted(words: list[str]) -> bool:
    """Whether the words count the rows from 0 or 1, which is no clock."""
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        return False
    return numbers[0] in (0, 1) and numbers == [numbers[0] + i for i in range(len(numbers))]


@foreign
def load(path: Path) -> Recording:
    """Read both streams, align the clocks, pair by interpolation."""
    found = _streams(path)
    if found is None:
        raise InputError(
            f"{path}: expected two files, one named like 'robot' or 'hand', one like 'camera' or 'target'"
        )
    (robot_stamps, robot), (camera_stamps, camera) = (_read(*place) for place in found)
    units = clock_units(robot_stamps, camera_stamps)
    robot_stamps, camera_stamps = in_seconds(robot_stamps, units[0]), in_seconds(camera_stamps, units[1])
    for (file, name), stamps in zip(found, (robot_stamps, camera_stamps), strict=True):
        if np.ptp(stamps) > _LONGEST_S:
            raise InputError(
                f"{file}{name and f': {name}'}: its stamps span {significant(np.ptp(stamps), 3)} s; give one recording"
            )
    hints, _ = hints_for(path)
    rows = np.arange(len(camera))
    offset, note = _offset(hints, robot_stamps, robot, camera_stamps, camera)
    if offset is not None:
        inside = (camera_stamps + offset >= robot_stamps[0]) & (camera_stamps + offset <= robot_stamps[-1])
        if not inside.any():
            raise InputError(f"{path}: the two streams do not overlap in time; check their clocks and units")
        rows, camera_stamps, camera = rows[inside], camera_stamps[inside], camera[inside]
        robot, robot_stamps = interpolate(robot_stamps, robot, camera_stamps + offset), camera_stamps + offset
    if units != ("s", "s"):
        note += f"; stamps read in {' and '.join(dict.fromkeys(units))}"
    step = -(-(rows[-1] + 1) // MOST_SAMPLES)
    kept = rows % step == 0
    documented = Documented(
        mounting=Mounting.EYE_IN_HAND,
        robot_rotation="quat_xyzw",
        target_inverted=True,
        target_rotation="quat_xyzw",
    )
    recording = paired(
        path,
        robot[kept],
        camera[kept],
        documented,
        hints,
        robot_stamp_s=robot_stamps[kept],
        camera_stamp_s=camera_stamps[kept],
    )
    note = f"{path}: {note}; {kept.sum()} of {len(kept)} pairs kept, every {step}. row"
    return replace(recording, notes=(*recording.notes, note))


def _offset(
    hints: Hints, robot_stamps: Array, robot: Array, camera_stamps: Array, camera: Array
) -> tuple[float | None, str]:
    """Seconds to add to the camera's stamps, None to pair row by row, and why."""
    if hints.time_offset_s is not None:
        return (
            hints.time_offset_s,
            f"robot poses interpolated at camera stamps + {hints.time_offset_s:.4f} s, as given",
        )
    if np.array_equal(robot_stamps, camera_stamps):
        lag = lag_s(robot_stamps, robot, camera)
        if lag is None:
            return None, "the stamps are equal, and the turning speeds show no lag: paired row by row"
        return lag, (
            f"the stamps are equal, but the turning speeds show a lag of {abs(lag):.3f} s: robot poses "
            f"interpolated at camera stamps + {lag:.4f} s"
        )
    offset, quality = time_offset_s(robot_stamps, robot, camera_stamps, camera)
    if offset is None:
        return 0.0, (
            f"the offset between the clocks is unknown (turning speeds correlate to {quality:.2f}): taken as none; "
            f"write time_offset_s into {HINTS_NAME}"
        )
    return offset, (
        f"robot poses interpolated at camera stamps + {offset:.4f} s (turning speeds correlate to {quality:.2f})"
    )


def _read(file: Path, name: str) -> tuple[Array, Array]:
    """Stamps (N,) in order, and poses (N, 7)."""
    source = f"{file}: {name}" if name else str(file)
    rows = table(zip_bytes(file, name).decode("utf-8", "replace") if name else text(file), source)
    if rows.shape[1] != 8:
        raise InputError(f"{source}: {rows.shape[1]} numbers a row; expected t, x y z, qx qy qz qw")
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    return rows[:, 0], rows[:, 1:]


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="trajectories",
        summary="two time-stamped trajectories, robot and camera: ethz/Kalibr CSV or TUM (folder or zip)",
        sniff=sniff,
        load=load,
    )
