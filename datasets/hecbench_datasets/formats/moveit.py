"""moveit_calibration samples (YAML or JSON): `effector_wrt_world` and `object_wrt_sensor`, 16 numbers each.

They do not say where the camera sits; the poses prove it. A joint states file (`joint_names`, `joint_values`)
beside them is read when it has as many rows.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from hecbench.errors import InputError
from hecbench.recording import Recording, RobotDescription
from hecbench.registry import hookimpl
from hecbench.specs import DatasetSpec
from hecbench_datasets.reading.hints import hints_for
from hecbench_datasets.reading.pairing import Documented, paired
from hecbench_datasets.reading.sources import (
    YAML_SUFFIXES,
    FileOfFormat,
    files_in,
    finite,
    foreign,
    head,
    item,
    yaml_value,
)

_SUFFIXES = (*YAML_SUFFIXES, ".json")
_ROBOT, _TARGET = "effector_wrt_world", "object_wrt_sensor"

_FILE = FileOfFormat(
    shows=lambda text: _ROBOT in text,
    described="moveit_calibration samples; check the file",
    suffixes=_SUFFIXES,
)


@foreign
def load(path: Path) -> Recording:
    """Read the samples, and the joint states beside them."""
    file = _FILE.of(path)
    samples = yaml_value(file)
    if not isinstance(samples, list) or not samples:
        raise InputError(f"{file}: expected a list of samples with {_ROBOT} and {_TARGET}")
    robot, target = (
        [finite(item(s, key, file), f"{file}: sample {i}: {key}", (16,)) for i, s in enumerate(samples)]
        for key in (_ROBOT, _TARGET)
    )
    hints, _ = hints_for(path)
    return paired(
        file,
        robot,
        target,
        Documented(),
        hints,
        camera=hints.camera_model(),
        **_joints(file, len(samples)),
    )


def _joints(samples: Path, count: int) -> dict[str, Any]:
    for file in files_in(samples.parent, *YAML_SUFFIXES):
        if file != samples and "joint_values" in head(file):
            content = yaml_value(file)
            names = item(content, "joint_names", file)
            values = finite(item(content, "joint_values", file), f"{file}: joint_values", (-1, len(names)))
            if len(values) == count:
                return {"joints_rad": values, "robot": RobotDescription(joint_names=tuple(map(str, names)))}
    return {}


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="moveit",
        summary="moveit_calibration samples (YAML or JSON), joint states beside them",
        sniff=_FILE.sniff,
        load=load,
    )
