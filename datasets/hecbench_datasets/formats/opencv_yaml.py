"""OpenCV FileStorage YAML with two numbered families of 4x4 matrices, as handeye_calib_camodocal writes it.

`T1_0, T1_1, ...` are base_T_flange and `T2_0, ...` camera_T_target there; other names are told apart by the
words in them, and OpenCV's own `gripper2base` and `target2cam` say the direction.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

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
_FIRST = re.compile(r"^\s*\w*(?<!\d)[01]\s*:\s*!!opencv-matrix", re.MULTILINE)

_FILE = FileOfFormat(
    shows=lambda text: _FIRST.search(text) is not None,
    described="OpenCV matrices numbered from 0 or 1, such as T1_0 and T2_0",
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
    for name, value in content.items() if isinstance(content, dict) else ():
        if match := _NUMBERED.match(str(name)):
            matrix = finite(value, f"{file}: {name}", (-1, 4))
            if len(matrix) not in (3, 4):
                raise InputError(f"{file}: {name}: has {len(matrix)} rows of 4; expected a 4x4 matrix")
            found.setdefault(match[1], {})[int(match[2])] = matrix[:3].ravel()
    return {
        name: finite([rows[i] for i in sorted(rows)], f"{file}: {name}")
        for name, rows in found.items()
        if sorted(rows) == list(range(min(rows), min(rows) + len(rows))) and min(rows) in (0, 1)
    }


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="opencv_yaml",
        summary="OpenCV YAML with numbered 4x4 matrices (handeye_calib_camodocal)",
        sniff=_FILE.sniff,
        load=load,
    )
