"""OpenCV FileStorage YAML with two numbered families of poses, as handeye_calib_camodocal writes it.

`T1_0, T1_1, ...` are base_T_flange and `T2_0, ...` camera_T_target there, 4x4. `R_gripper2base_0` and
`t_gripper2base_0`, a rotation (3x3, or a vector) and a translation, are one pose. Other names are distinguished by the
words in them, and OpenCV's own `gripper2base` and `target2cam` say the direction.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import DatasetSpec
from hecbench_datasets.reading.hints import hints_for
from hecbench_datasets.reading.pairing import Documented, paired
from hecbench_datasets.reading.sources import YAML_SUFFIXES, FileOfFormat, finite, foreign, yaml_value

_ROBOT = re.compile(r"T1|robot|gripper|flange|hand|tool|ee\b|base", re.IGNORECASE)
_TARGET = re.compile(r"T2|target|cam|marker|board|tag|eye", re.IGNORECASE)
_NUMBERED = re.compile(r"^(\w*?)_?(\d+)$")
_PART = re.compile(r"^(R|rot|rotation|rvec|t|trans|translation|tvec)_(\w+)$")
_FIRST = re.compile(
    r"^\s*\w*(?<!\d)[01]\s*:\s*!!opencv-matrix|^\s*\w+\s*:\s*\n\s*-\s*!!opencv-matrix", re.MULTILINE
)

_FILE = FileOfFormat(
    shows=lambda text: _FIRST.search(text) is not None,
    described="OpenCV matrices numbered from 0 or 1, such as T1_0 and T2_0, or sequences of them",
    suffixes=YAML_SUFFIXES,
)


@foreign
def load(path: Path) -> Recording:
    """Read the pairs."""
    file = _FILE.of(path)
    families = _families(file)
    robot = [name for name in families if _ROBOT.search(name) and not _TARGET.search(name)]
    target = [name for name in families if _TARGET.search(name)]
    if len(robot) != 1 or len(target) != 1:
        raise InputError(
            f"{file}: its matrices are called {', '.join(families) or 'nothing'}; expected one family of "
            "robot poses (T1_0, robot_0, gripper2base_0 ...) and one of target poses (T2_0, target2cam_0 ...)"
        )
    hints, _ = hints_for(path)
    documented = Documented(
        robot_inverted="base2" in robot[0].lower(), target_inverted="cam2" in target[0].lower()
    )
    poses = families[robot[0]], families[target[0]]
    return paired(file, *poses, documented, hints)


def _families(file: Path) -> dict[str, Array]:
    content = yaml_value(file)
    found: dict[str, dict[int, Array]] = {}
    parts: dict[tuple[str, int], dict[str, Array]] = {}
    for name, value in _numbered(content):
        if not (match := _NUMBERED.match(str(name))):
            continue
        where, family, number = f"{file}: {name}", match[1], int(match[2])
        if part := _PART.match(family):
            parts.setdefault((part[2], number), {})[part[1][0].lower()] = finite(value, where)
            continue
        matrix = finite(value, where, (-1, 4))
        if len(matrix) not in (3, 4):
            raise InputError(f"{where}: has {len(matrix)} rows of 4; expected a 4x4 matrix")
        found.setdefault(family, {})[number] = matrix[:3].ravel()
    for (family, number), pose in parts.items():
        found.setdefault(family, {})[number] = _joined(f"{file}: {family}_{number}", pose)
    return {
        name: finite([rows[i] for i in sorted(rows)], f"{file}: {name}")
        for name, rows in found.items()
        if sorted(rows) == list(range(min(rows), min(rows) + len(rows))) and min(rows) in (0, 1)
    }


def _numbered(content: Any) -> Iterator[tuple[str, Any]]:
    """Names and matrices; those of a sequence are numbered from 0."""
    for name, value in content.items() if isinstance(content, dict) else ():
        if isinstance(value, list) and value and all(isinstance(one, np.ndarray) for one in value):
            yield from ((f"{name}_{number}", one) for number, one in enumerate(value))
        else:
            yield str(name), value


def _joined(where: str, pose: dict[str, Array]) -> Array:
    """The numbers (12,) of a rotation, a matrix or a vector, and a translation."""
    sizes = {name: value.size for name, value in pose.items()}
    if sizes.get("t") != 3 or sizes.get("r") not in (3, 9):
        raise InputError(f"{where}: expected R (3x3, or a vector of 3) and t (3), found {sizes}")
    turn = pose["r"].reshape(3, 3) if sizes["r"] == 9 else se3.so3_exp(pose["r"].ravel())
    return np.asarray(np.column_stack([turn, pose["t"].ravel()]).ravel())


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="opencv_yaml",
        summary="OpenCV YAML with numbered 4x4 matrices (handeye_calib_camodocal)",
        sniff=_FILE.sniff,
        load=load,
    )
