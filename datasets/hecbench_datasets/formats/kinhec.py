"""KinHEC datasets (Parquet): one sequence is one recording, ``ROOT/noise-000000``.

The package `kinhec` generates them (`kinhec generate --tier smoke --out ROOT`). The measured streams are
read, paired at the camera's instants, and the truth is kept (X for a camera on the hand, Y for a fixed one,
of its ``base_T_ee X = Y camera_T_target``). Frames without a measurement are left out.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import Mounting, Recording, RobotDescription
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import DatasetSpec
from hecbench.system.wording import significant
from hecbench_datasets.reading.sources import foreign
from hecbench_datasets.reading.streams import interpolate

INDEX = "sequences.parquet"
_POSE = ("px", "py", "pz", "qw", "qx", "qy", "qz")


def sniff(path: Path) -> bool:
    """A dataset's root, or a sequence's name in it."""
    return (path / INDEX).is_file() or (not path.exists() and (path.parent / INDEX).is_file())


@foreign
def load(path: Path) -> Recording:
    """Read one sequence."""
    if (path / INDEX).is_file():
        names = sequence_ids(path)
        raise InputError(
            f"{path}: holds {len(names)} sequences; name one, such as {path / names[0]}, {names[-1]}"
        )
    root, name = path.parent, path.name
    rows = _columns(root / INDEX)
    matching = np.flatnonzero(rows["sequence_id"] == name)
    if len(matching) != 1:
        raise InputError(f"{root / INDEX}: has no sequence '{name}'; see sequence_id in it")
    sequence = {key: values[matching[0]] for key, values in rows.items()}
    robot = _columns(root / sequence["robot_file"], int(sequence["robot_row_group"]))
    camera = _columns(root / sequence["camera_file"], int(sequence["camera_row_group"]))
    camera_T_target = _poses(camera, "cam_target_meas")
    measured = np.isfinite(camera_T_target).all((1, 2))
    stamps = camera["t"] - sequence["time_offset_s"]
    measured &= (stamps >= robot["t"][0] - 1e-6) & (stamps <= robot["t"][-1] + 1e-6)
    if not measured.any():
        raise InputError(f"{path}: no camera frame has a measurement within the robot's stream")
    rows_at = interpolate(robot["t"], _rows(robot, "base_ee_meas", scalar_first=False), stamps[measured])
    mounting = Mounting(str(sequence["configuration"]))
    truth = "X" if mounting is Mounting.EYE_IN_HAND else "Y"
    notes = [f"{path}: true clock offset {sequence['time_offset_s']:.4f} s removed"]
    if sequence["scale"] != 1:
        notes.append(
            f"{path}: target translations carry the unknown scale {significant(sequence['scale'], 3)}"
        )
    return Recording(
        name=name,
        mounting=mounting,
        sample_ids=tuple(f"{frame:06d}" for frame in camera["frame"][measured]),
        robot=RobotDescription(base_link="base", flange_link="ee"),
        truth_parent_T_camera=_poses({key: values[matching] for key, values in rows.items()}, truth)[0],
        base_T_flange=se3.from_quat_xyzw(rows_at[:, 3:], rows_at[:, :3]),
        camera_T_target=camera_T_target[measured],
        robot_stamp_s=stamps[measured],
        camera_stamp_s=camera["t"][measured],
        folder=root,
        notes=tuple(notes),
    )


def sequence_ids(root: Path) -> list[str]:
    """The names of a dataset's sequences."""
    return [str(name) for name in _columns(root / INDEX)["sequence_id"]]


def true_X(root: Path) -> dict[str, Array]:
    """KinHEC's X (4, 4) of each sequence: flange_T_camera, or flange_T_target for a fixed camera."""
    return dict(zip(sequence_ids(root), _poses(_columns(root / INDEX), "X"), strict=True))


def _columns(file: Path, row_group: int | None = None) -> dict[str, Any]:
    import pyarrow
    from pyarrow import parquet

    try:
        table = parquet.ParquetFile(file)
        content = table.read() if row_group is None else table.read_row_group(row_group)
    except (OSError, pyarrow.ArrowException, IndexError) as error:
        raise InputError(f"{file}: cannot be read as Parquet ({error}); generate it again") from error
    return {
        name: content[name].to_numpy(zero_copy_only=False)
        for name in content.column_names
        if not name.startswith("q_")
    }


def _rows(columns: dict[str, Any], prefix: str, *, scalar_first: bool) -> Array:
    try:
        rows = np.stack([np.asarray(columns[f"{prefix}_{name}"], float) for name in _POSE], 1)
    except KeyError as error:
        raise InputError(f"KinHEC: column {error} is missing; generate the dataset again") from error
    return rows if scalar_first else np.hstack([rows[:, :3], rows[:, 4:], rows[:, 3:4]])


def _poses(columns: dict[str, Any], prefix: str) -> Array:
    """Transforms (N, 4, 4) m, NaN where a frame has none."""
    rows = _rows(columns, prefix, scalar_first=True)
    poses = np.full((len(rows), 4, 4), np.nan)
    given = np.isfinite(rows).all(1)
    poses[given] = se3.from_quat_wxyz(rows[given, 3:], rows[given, :3])
    return poses


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="kinhec",
        summary="a sequence of a KinHEC dataset (Parquet): ROOT/noise-000000",
        sniff=sniff,
        load=load,
        imports=("pyarrow",),
    )
