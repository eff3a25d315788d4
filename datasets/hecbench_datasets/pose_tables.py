"""Two tables of poses without stamps, one row a sample: x y z and a rotation of 3 or 4 numbers, or 12 or 16.

The files' names say which is the robot's. UR's `p[x,y,z,rx,ry,rz]` is understood. Units, quaternion or Euler
order, degrees, directions and mounting are proven by consistency. With pictures instead of a second table the
mounting and the rotation must be told.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from hecbench.conventions import HINTS_NAME
from hecbench.errors import InputError
from hecbench.pose_numbers import readings
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import DatasetSpec
from hecbench_datasets.reading.hints import hinted_target, hints_for
from hecbench_datasets.reading.pairing import Documented, paired
from hecbench_datasets.reading.sources import IMAGE_SUFFIXES, Array, files_in, foreign, head, table, text

_ROBOT = re.compile(r"robot|flange|gripper|hand|effector|tool|base_T|tcp|\bposes?$", re.IGNORECASE)
_TARGET = re.compile(r"cam|target|marker|tag|board|tracking", re.IGNORECASE)
_SUFFIXES = (".csv", ".txt", ".tsv")
_LENGTHS = (6, 7, 12, 16)


def _rows(content: str, source: str) -> Array:
    return table(re.sub(r"p?\[|\]", " ", content), source)


def _columns(file: Path) -> int:
    lines = head(file).splitlines()
    try:
        return len(_rows("\n".join(lines[: max(len(lines) - 1, 1)]), str(file))[0])
    except InputError:
        return 0


def _files(path: Path) -> tuple[Path | None, Path | None]:
    tables = [file for file in files_in(path, *_SUFFIXES) if _columns(file) in _LENGTHS]
    target = [file for file in tables if _TARGET.search(file.stem) and not _ROBOT.search(file.stem)]
    robot = [file for file in tables if _ROBOT.search(file.stem) and file not in target]
    return (robot[0] if len(robot) == 1 else None), (target[0] if len(target) == 1 else None)


def sniff(path: Path) -> bool:
    """A folder with one table of robot poses, and one of target poses or pictures."""
    robot, target = _files(path)
    return robot is not None and (target is not None or bool(files_in(path, *IMAGE_SUFFIXES)))


@foreign
def load(path: Path) -> Recording:
    """Read the tables."""
    robot_file, target_file = _files(path)
    if robot_file is None:
        raise InputError(
            f"{path}: holds no single table of robot poses (robot.csv) of 6, 7, 12 or 16 columns"
        )
    robot = _rows(text(robot_file), str(robot_file))
    hints, hints_file = hints_for(path)
    camera = hints.camera_model()
    if target_file is not None:
        target = _rows(text(target_file), str(target_file))
        return paired(path, robot, target, Documented(), hints, camera=camera)
    images = files_in(path, *IMAGE_SUFFIXES)
    if len(images) != len(robot):
        raise InputError(
            f"{path}: {len(images)} pictures for {len(robot)} rows of {robot_file.name}; pair them"
        )
    if hints.mounting is None or (robot.shape[1] in (6, 7) and hints.robot_rotation is None):
        raise InputError(
            f"{path}: without target poses nothing proves the convention; write mounting, robot_rotation "
            f"(rotvec, quat_xyzw, euler_ZYX ...) and target into {HINTS_NAME}"
        )
    reading = readings(
        robot,
        ("base", "flange"),
        rotation=hints.robot_rotation,
        unit=hints.robot_unit,
        inverted=hints.robot_pose == "flange_T_base",
    )[0]
    return Recording(
        name=path.resolve().name,
        mounting=hints.mounting,
        sample_ids=tuple(image.stem for image in images),
        camera=camera,
        target=hinted_target(hints, hints_file),
        base_T_flange=reading.poses,
        images=tuple(images),
        folder=path,
        notes=(f"{path}: read as {hints.mounting}, {reading.text}, as told",),
    )


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="pose_tables",
        summary="two tables of poses (robot.csv, target.csv), or one beside pictures; conventions proven",
        sniff=sniff,
        load=load,
    )
