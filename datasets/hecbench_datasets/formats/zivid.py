"""Zivid hand-eye folders: `robot_pose_*.yaml` (or `pos*.yaml`) in mm, the board's poses, pictures.

`checkerboard_pose_in_camera_frame_*.yaml` hold camera_T_target. Point clouds (.zdf) need Zivid's SDK and are
not read; with pictures beside them (png) and a target in the hints, the detector does the rest.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from hecbench.errors import InputError
from hecbench.exchange.conventions import HINTS_NAME
from hecbench.exchange.pose_numbers import pose_conventions
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import DatasetSpec
from hecbench_datasets.reading.hints import hinted_target, hints_for
from hecbench_datasets.reading.pairing import Documented, paired
from hecbench_datasets.reading.sources import (
    IMAGE_SUFFIXES,
    YAML_SUFFIXES,
    files_in,
    finite,
    foreign,
    yaml_value,
)

_ROBOT = re.compile(r"(?:robot_pose_|pos)(\d+)$")
_BOARD = re.compile(r"checkerboard_pose_in_camera_frame_(\d+)$")
_PICTURE = re.compile(r"(?:calibration_object_pose_|img)(\d+)$")


def _numbered(path: Path, pattern: re.Pattern[str], *suffixes: str) -> dict[str, Path]:
    found = ((pattern.match(file.stem), file) for file in files_in(path, *suffixes))
    return {match[1]: file for match, file in found if match}


def sniff(path: Path) -> bool:
    """A folder with numbered `robot_pose_*.yaml` or `pos*.yaml`."""
    return bool(_numbered(path, _ROBOT, *YAML_SUFFIXES))


@foreign
def load(path: Path) -> Recording:
    """Read robot poses, and the board's poses or the pictures."""
    robot = _numbered(path, _ROBOT, *YAML_SUFFIXES)
    board = _numbered(path, _BOARD, *YAML_SUFFIXES)
    pictures = _numbered(path, _PICTURE, *IMAGE_SUFFIXES)
    if not robot:
        raise InputError(f"{path}: holds no robot_pose_*.yaml or pos*.yaml")
    hints, hints_file = hints_for(path)
    camera = hints.camera_model()
    if board:
        both = [number for number in robot if number in board]
        return paired(
            path,
            [_matrix(robot[number]) for number in both],
            [_matrix(board[number]) for number in both],
            Documented(),
            hints,
            ids=both,
            camera=camera,
        )
    if not pictures or hints.mounting is None:
        raise InputError(
            f"{path}: has robot poses but no checkerboard_pose_in_camera_frame_*.yaml; beside pictures "
            f"(img01.png ...) give mounting and target in {HINTS_NAME}: point clouds (.zdf) are not read"
        )
    poses = pose_conventions(
        [_matrix(file) for file in robot.values()],
        ("base", "flange"),
        unit=hints.robot_unit,
        inverted=hints.robot_pose == "flange_T_base",
    )
    return Recording(
        name=path.resolve().name,
        mounting=hints.mounting,
        sample_ids=tuple(robot),
        camera=camera,
        target=hinted_target(hints, hints_file),
        base_T_flange=poses[0].poses,
        images=tuple(pictures.get(number) for number in robot),
        folder=path,
        notes=(f"{path}: read as {hints.mounting}, {poses[0].text}",),
    )


def _matrix(file: Path) -> Array:
    """The first 4x4 matrix of a file: OpenCV's, or nested lists such as FloatMatrix.Data."""
    waiting: list[Any] = [yaml_value(file)]
    while waiting:
        value = waiting.pop(0)
        if isinstance(value, dict):
            waiting.extend(value.values())
        elif isinstance(value, list | np.ndarray) and np.size(np.asarray(value, dtype=object)) == 16:
            return finite(value, str(file), (16,))
    raise InputError(f"{file}: holds no 4x4 matrix")


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="zivid",
        summary="Zivid hand-eye folder: robot_pose_*.yaml or pos*.yaml in mm, board poses or pictures",
        sniff=sniff,
        load=load,
    )
