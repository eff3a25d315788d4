"""A folder in nobody's format: tables of poses or joints in any spelling, beside each other or beside pictures.

Words in headers and file names say which stream is the robot's. Units, orders, directions and the mounting are proven
by consistency; beside pictures, the target is found in them first. It is tried when no other format fits.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from hecbench.errors import InputError
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import DatasetSpec
from hecbench_datasets.reading.beside_pictures import load_beside_pictures
from hecbench_datasets.reading.columns import ROBOT_WORDS, TARGET_WORDS, Columns, Poses
from hecbench_datasets.reading.hints import Hints, hints_for
from hecbench_datasets.reading.nearest import nearest_format
from hecbench_datasets.reading.pairing import Documented, paired
from hecbench_datasets.reading.sources import foreign
from hecbench_datasets.reading.survey import Survey, survey
from hecbench_datasets.reading.tables import TABLE_SUFFIXES

_FEWEST_BELOW = 5
"""Poses of each kind by which two streams in one table prove themselves."""


def sniff(path: Path) -> bool:
    """Any folder, and any file that may be a table."""
    return path.is_dir() or (path.suffix.lower() in TABLE_SUFFIXES and path.is_file())


@foreign
def load(path: Path) -> Recording:
    """Read what is there, and prove how."""
    found = survey(path)
    hints, hints_file = hints_for(path)
    robot, target = _streams(found)
    if robot is not None and target is not None:
        documented = Documented(
            robot_rotation=robot.rotations or None,
            robot_unit=robot.unit,
            target_rotation=target.rotations or None,
            target_unit=target.unit,
        )
        return paired(path, robot.numbers, target.numbers, documented, hints, camera=hints.camera_model())
    if robot is not None and not found.pictures and (both := _one_below_the_other(path, robot, hints)):
        return both
    stream = _of_robot(found, robot)
    if stream is not None and found.pictures:
        return load_beside_pictures(found, stream, robot, hints, hints_file)
    raise InputError(f"{path}: holds {found.found}; {_missing(found, robot)}")


def _one_below_the_other(path: Path, rows: Poses, hints: Hints) -> Recording | None:
    """The recording of one table that holds the robot's rows and then the target's, where that proves itself."""
    half, rest = divmod(len(rows.numbers), 2)
    if rest or half < _FEWEST_BELOW:
        return None
    documented = Documented(robot_rotation=rows.rotations or None, target_rotation=rows.rotations or None)
    try:
        found = paired(
            path, rows.numbers[:half], rows.numbers[half:], documented, hints, camera=hints.camera_model()
        )
    except InputError:
        return None
    note = f"{path}: rows 1 to {half} taken for the robot's, the {half} below them for the target's"
    return replace(found, notes=(note, *found.notes))


def _of_robot(found: Survey, robot: Poses | None) -> Columns | None:
    """The stream of the robot's poses, else the only one with joints."""
    if robot is not None:
        return next(stream for stream in found.streams if robot in stream.poses)
    joints = [stream for stream in found.streams if stream.joints is not None]
    return joints[0] if len(joints) == 1 else None


def _streams(found: Survey) -> tuple[Poses | None, Poses | None]:
    """The robot's and the target's poses, by the words of columns, then of files."""
    named = [(_words(found, stream, poses), poses) for stream in found.streams for poses in stream.poses]
    target = [poses for words, poses in named if _calls(words) == "target"]
    robot = [poses for words, poses in named if _calls(words) == "robot"]
    unnamed = [poses for words, poses in named if _calls(words) is None]
    if not robot and len(unnamed) == 1:
        robot = unnamed
    elif not target and len(unnamed) == 1 and robot:
        target = unnamed
    return (robot[0] if len(robot) == 1 else None), (target[0] if len(target) == 1 else None)


def _words(found: Survey, stream: Columns, poses: Poses) -> tuple[str, str]:
    source = Path(stream.source)
    inside = source.relative_to(found.path) if source.is_relative_to(found.path) else Path(source.name)
    return poses.name, str(inside.with_suffix("")) if inside.name else source.stem


def _calls(words: tuple[str, str]) -> str | None:
    """Whose poses these are: the columns' words go before the file's."""
    for text in words:
        robot, target = ROBOT_WORDS.search(text), TARGET_WORDS.search(text)
        if robot or target:
            return "target" if target and not robot else "robot"
    return None


def _missing(found: Survey, robot: Poses | None) -> str:
    """The nearest format, or the one thing to add."""
    folder = found.path if found.path.is_dir() else found.path.parent
    if robot is not None:
        near = "pictures of the target, or a table target.csv of its poses in the camera, are missing"
    elif any(stream.poses or stream.joints is not None for stream in found.streams):
        near = "which of them is the robot's stays open: call it robot.csv, and the other one target.csv"
    else:
        near = "a table robot.csv is missing, of the robot's joints or poses (x y z and 3 or 4 numbers of the rotation)"
        near = nearest_format(found.files, folder) or near
    return near


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="pose_tables",
        summary="a plain folder: tables of poses or joints, or one beside pictures; conventions proven",
        sniff=sniff,
        load=load,
        last_resort=True,
    )
