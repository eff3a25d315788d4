"""ViSP hand-eye folders: images, `*pose_rPe_*.yaml` (base_T_flange: position and theta-u), camera XML.

`chessboard-data.txt` or `apriltag-data.txt` describes the target; the mounting stands in the folder's name.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import CameraModel, Mounting, Recording, RobotDescription
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import DatasetSpec
from hecbench.targets import ANY_TAG, AprilTagTarget, ChessboardTarget, Target
from hecbench_datasets.reading.hints import hinted_target, hints_for
from hecbench_datasets.reading.sources import (
    IMAGE_SUFFIXES,
    YAML_SUFFIXES,
    files_in,
    finite,
    foreign,
    item,
    text,
    yaml_value,
)

_POSE = re.compile(r"pose_\w*?[rf]Pe\w*?(\d+)$")


def _pose_files(path: Path) -> dict[str, Path]:
    found = ((_POSE.search(file.stem), file) for file in files_in(path, *YAML_SUFFIXES))
    return {match[1]: file for match, file in found if match}


def sniff(path: Path) -> bool:
    """A folder with numbered `*pose_rPe_*.yaml`."""
    return bool(_pose_files(path))


@foreign
def load(path: Path) -> Recording:
    """Read poses and camera; the images are for the detector."""
    poses = _pose_files(path)
    if not poses:
        raise InputError(f"{path}: holds no *_pose_rPe_1.yaml ...; check the folder")
    values = np.array(
        [finite(item(yaml_value(file), "data", file), str(file), (6,)) for file in poses.values()]
    )
    images = {
        match[1]: file
        for file in files_in(path, *IMAGE_SUFFIXES)
        if (match := re.search(r"(\d+)$", file.stem))
    }
    hints, hints_file = hints_for(path)
    return Recording(
        name=path.resolve().name,
        mounting=hints.mounting or _mounting(path),
        sample_ids=tuple(poses),
        robot=RobotDescription(base_link="panda_link0", flange_link="panda_EE"),
        camera=hints.camera_model() or _camera(path),
        target=hinted_target(hints, hints_file) or _target(path),
        base_T_flange=se3.from_rotvec(values[:, 3:], values[:, :3]),
        images=tuple(images.get(number) for number in poses),
        folder=path,
    )


def _mounting(path: Path) -> Mounting:
    name = path.resolve().name.replace("-", "_")
    for mounting in Mounting:
        if mounting in name:
            return mounting
    raise InputError(
        f"{path}: does not say where the camera sits; name it *eye-in-hand* or *eye-to-hand*, or write "
        "'mounting: eye_in_hand' into hecbench-import.yaml in it"
    )


def _camera(path: Path) -> CameraModel | None:
    files = files_in(path, ".xml")
    if not files:
        return None
    try:
        tree = ElementTree.fromstring(text(files[0]))
    except ElementTree.ParseError as error:
        raise InputError(f"{files[0]}: is not readable XML ({error})") from error

    def number(name: str) -> float:
        node = tree.find(f".//{name}")
        return float(finite((node is not None and node.text) or "", f"{files[0]}: <{name}>", (1,))[0])

    K: Array = np.array([[number("px"), 0, number("u0")], [0, number("py"), number("v0")], [0, 0, 1.0]])
    radial = number("kud") if tree.find(".//kud") is not None else 0.0
    distortion = np.array([radial, 0, 0, 0]) if radial else np.zeros(0)
    return CameraModel(int(number("image_width")), int(number("image_height")), K, distortion)


def _target(path: Path) -> Target | None:
    for file in files_in(path, ".txt"):
        content = text(file)
        size = re.search(r"size:\s*([\d.]+)", content)
        grid = re.search(r"(\d+)\s*x\s*(\d+)", content)
        family = re.search(r"(?:tag)?(36h11|25h9|16h5)", content)
        if size and family:
            tag = re.search(r"\bid:?\s*(\d+)", content, re.IGNORECASE)
            return AprilTagTarget(f"tag{family[1]}", int(tag[1]) if tag else ANY_TAG, float(size[1]))
        if size and grid:
            return ChessboardTarget(int(grid[1]), int(grid[2]), float(size[1]))
    return None


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="visp",
        summary="ViSP hand-eye folder: images, *_pose_rPe_*.yaml, camera XML",
        sniff=sniff,
        load=load,
    )
