"""Robot poses or joints beside pictures: the target is found in the pictures first, to prove the convention."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hecbench.errors import InputError
from hecbench.exchange.conventions import HINTS_NAME
from hecbench.exchange.pose_numbers import pose_conventions
from hecbench.recording import CameraModel, Mounting, Recording
from hecbench.system import pictures
from hecbench_datasets.reading import kalibr
from hecbench_datasets.reading.cameras import camera_in
from hecbench_datasets.reading.columns import Columns, Poses
from hecbench_datasets.reading.hints import Hints, hinted_target
from hecbench_datasets.reading.joint_poses import RobotReading, joint_readings
from hecbench_datasets.reading.pictured_proof import settled
from hecbench_datasets.reading.seen_targets import seen_target
from hecbench_datasets.reading.sources import natural
from hecbench_datasets.reading.survey import Survey


@dataclass(frozen=True)
class Beside:
    """Rows of one stream and their pictures."""

    stream: Columns
    poses: Poses | None
    rows: list[int]
    images: list[Path]


def load_beside_pictures(
    found: Survey, stream: Columns, poses: Poses | None, hints: Hints, file: Path
) -> Recording:
    """The recording of a stream and the folder's pictures, its convention proven by the target seen in them.

    Args:
        found: the folder's files.
        stream: with robot poses or joints.
        poses: the robot's, None when it has joints.
        hints: of the user, and the file where they stand or would stand.

    Raises:
        InputError: the pictures do not pair with the rows, the target is not described, or no reading is proven.
    """
    beside = _paired(found, stream, poses, hints)
    camera, notes = _camera(found, beside.images[0], hints)
    notes += _absent(beside)
    target = hinted_target(hints, file) or kalibr.target_in(found.files, notes)
    robots = _robots(found, hints)
    declared = hints.mounting is not None and (hints.robot_rotation is not None or _is_matrix(poses))
    if target is None and not declared:
        raise InputError(
            f"{found.path}: {len(beside.images)} pictures beside {stream.source} ({stream.found}); "
            f"{seen_target(beside.images)} into {file}"
        )
    ways = _ways(beside, hints, robots)
    recording = Recording(
        name=found.path.resolve().name,
        mounting=hints.mounting or Mounting.EYE_TO_HAND,
        sample_ids=_ids(beside.images, found.path),
        camera=camera,
        target=target,
        joints_rad=np.zeros((len(beside.images), 1)),
        images=tuple(beside.images),
        depths=_depths(found, beside.images, notes),
        folder=found.path if found.path.is_dir() else found.path.parent,
        notes=tuple(notes),
    )
    return settled(found.path, recording, ways, hints, declared and (target is None or len(ways) == 1))


def _ways(beside: Beside, hints: Hints, robots: Sequence[str | Path]) -> list[RobotReading]:
    """Every reading of the robot's rows."""
    if beside.poses is None:
        assert beside.stream.joints is not None
        joints = beside.stream.joints[beside.rows]
        return joint_readings(joints, beside.stream.joint_names, robots)
    return [
        RobotReading(reading)
        for reading in pose_conventions(
            beside.poses.numbers[beside.rows],
            ("base", "flange"),
            rotation=hints.robot_rotation,
            assumed_rotation=beside.poses.rotations or None,
            unit=hints.robot_unit or beside.poses.unit,
            inverted=None if hints.robot_pose is None else hints.robot_pose == "flange_T_base",
        )
    ]


def _paired(found: Survey, stream: Columns, poses: Poses | None, hints: Hints) -> Beside:
    """Rows and pictures, by the column of names, by equal counts, or by the numbers in the names."""
    rows = poses.numbers if poses is not None else stream.joints
    assert rows is not None
    count = len(rows)
    folders = {
        folder: files
        for folder, files in found.pictures.items()
        if hints.images in (None, _relative(folder, found.path))
    }
    if stream.images is not None:
        return Beside(
            stream, poses, *_by_name(stream, [file for files in folders.values() for file in files])
        )
    fitting = [files for files in folders.values() if len(files) == count]
    every = sorted(
        (file for files in folders.values() for file in files),
        key=lambda f: natural(f.relative_to(found.path)),
    )
    if not fitting and len(every) == count:
        fitting = [
            sorted(every, key=lambda file: [natural(part) for part in file.relative_to(found.path).parts])
        ]
    if len(fitting) == 1:
        return Beside(stream, poses, list(range(count)), fitting[0])
    if len(fitting) > 1:
        names = " and ".join(_relative(files[0].parent, found.path) for files in fitting[:3])
        raise InputError(
            f"{found.path}: {names} both hold {count} pictures, two for one pose; write 'images: "
            f"{_relative(fitting[0][0].parent, found.path)}' into {HINTS_NAME}"
        )
    shown = " and ".join(
        f"{len(files)} pictures" + (f" in {_relative(folder, found.path)}" if len(folders) > 1 else "")
        for folder, files in folders.items()
    )
    raise InputError(
        f"{found.path}: {shown or 'no pictures'} for {count} rows of {Path(stream.source).name}; pair them up, or add "
        "a column with the pictures' names"
    )


def _by_name(stream: Columns, pictures: list[Path]) -> tuple[list[int], list[Path]]:
    rows, images = [], []
    for row, name in enumerate(stream.images or ()):
        wanted = name.replace("\\", "/").lstrip("./")
        same = [file for file in pictures if file.as_posix().endswith(f"/{wanted}")]
        same = same or [file for file in pictures if file.name == Path(wanted).name]
        if len(same) > 1:
            raise InputError(
                f"{stream.source}: row {row + 1}: '{name}' may be {same[0]} or {same[1]}; name its folder"
            )
        if same:
            rows.append(row)
            images.append(same[0])
    if not rows:
        raise InputError(f"{stream.source}: none of the pictures that it names is there; put them beside it")
    twice = {image for image in images if images.count(image) > 1}
    if twice:
        raise InputError(
            f"{stream.source}: {min(twice).name} stands in several rows, one picture for two poses; keep one"
        )
    return rows, images


def _absent(beside: Beside) -> list[str]:
    """What is said of rows whose picture is not there."""
    named = beside.stream.images or ()
    absent = [named[row] for row in range(len(named)) if row not in set(beside.rows)]
    if not absent:
        return []
    shown = ", ".join(absent[:3]) + (", ..." if len(absent) > 3 else "")
    return [
        f"{beside.stream.source}: left out {len(absent)} of {len(named)} rows, whose pictures are not there: {shown}"
    ]


_WORDS = re.compile(r"depth|colou?r|rgb|image|aligned|raw", re.IGNORECASE)
"""What the names of a picture and of its depth do not share."""


def _depths(found: Survey, images: Sequence[Path], notes: list[str]) -> tuple[Path | None, ...] | None:
    """The depth of each picture, by what their names share, or in their order where there are as many."""
    if not found.depths:
        return None
    by_name = {_WORDS.sub("", file.stem).strip("_-. "): file for file in found.depths}
    paired = [by_name.get(_WORDS.sub("", image.stem).strip("_-. ")) for image in images]
    if len(by_name) < len(found.depths) or not any(paired):
        if len(found.depths) != len(images):
            notes.append(
                f"{found.path}: {len(found.depths)} depth pictures for {len(images)} pictures and no common names: left"
                " out; name each as its picture"
            )
            return None
        paired = list(found.depths)
    notes.append(f"{found.path}: depth of {sum(one is not None for one in paired)} pictures")
    return tuple(paired)


def _relative(folder: Path, path: Path) -> str:
    return folder.relative_to(path).as_posix() if path.is_dir() else folder.name


def _ids(images: Sequence[Path], path: Path) -> tuple[str, ...]:
    """The pictures' names, with their folders where names repeat."""
    stems = [image.stem for image in images]
    if len(set(stems)) == len(stems):
        return tuple(stems)
    return tuple(re.sub(r"[/\\]", "_", str(image.relative_to(path).with_suffix(""))) for image in images)


def _camera(found: Survey, picture: Path, hints: Hints) -> tuple[CameraModel | None, list[str]]:
    if hints.camera is not None:
        return hints.camera_model(), []
    pictures.size(picture)
    return camera_in(found.files, picture)


def _robots(found: Survey, hints: Hints) -> list[str | Path]:
    folder = found.path if found.path.is_dir() else found.path.parent
    if hints.robot is not None:
        return [folder / hints.robot if hints.robot.endswith(".urdf") else hints.robot]
    return [file for file in found.files if file.suffix == ".urdf"]


def _is_matrix(poses: Poses | None) -> bool:
    return poses is not None and poses.numbers.shape[1] in (12, 16)
