"""A scene in the BOP format: scene_camera.json, scene_gt.json, rgb/, mask_visib/ (lengths in mm).

`cam_R_w2c, cam_t_w2c` is the camera's pose as the rig reports it. It stands for the flange here: the answer
is then flange_T_camera, the identity when the rig was calibrated perfectly. The object seen in most images is
the target.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import CameraModel, Mounting, Recording, RobotDescription
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import DatasetSpec
from hecbench.system import pictures
from hecbench_datasets.reading.sources import (
    IMAGE_SUFFIXES,
    files_in,
    finite,
    foreign,
    head,
    item,
    json_value,
)

_CAMERA, _OBJECTS = "scene_camera.json", "scene_gt.json"


def sniff(path: Path) -> bool:
    """A folder with both scene files."""
    return '"cam_K"' in head(path / _CAMERA) and (path / _OBJECTS).is_file()


@foreign
def load(path: Path) -> Recording:
    """Read the images that have a camera pose and show the most frequent object."""
    cameras, objects = json_value(path / _CAMERA), json_value(path / _OBJECTS)
    counts = Counter(seen["obj_id"] for views in objects.values() for seen in views)
    if not counts:
        raise InputError(f"{path / _OBJECTS}: lists no object")
    wanted = counts.most_common(1)[0][0]
    files = {file.stem: file for kind in ("rgb", "gray") for file in files_in(path / kind, *IMAGE_SUFFIXES)}
    ids, base_T_flange, camera_T_target, intrinsics, images = [], [], [], [], []
    for key, camera in cameras.items():
        seen = next((view for view in objects.get(key, ()) if view["obj_id"] == wanted), None)
        if seen is None or "cam_R_w2c" not in camera:
            continue
        ids.append(f"{int(key):06d}")
        base_T_flange.append(se3.inverse(_pose(camera, "cam_R_w2c", "cam_t_w2c", path / _CAMERA, key)))
        camera_T_target.append(_pose(seen, "cam_R_m2c", "cam_t_m2c", path / _OBJECTS, key))
        intrinsics.append(finite(item(camera, "cam_K", path / _CAMERA), f"{path / _CAMERA}: cam_K", (3, 3)))
        images.append(files.get(ids[-1]))
    if not ids:
        raise InputError(f"{path}: no image has both cam_R_w2c and object {wanted}")
    first = next((image for image in images if image is not None), None)
    if np.ptp(intrinsics, axis=0).max() > 1e-6:
        first = None
    return Recording(
        name=path.resolve().name,
        mounting=Mounting.EYE_IN_HAND,
        sample_ids=tuple(ids),
        robot=RobotDescription(base_link="world", flange_link="reported_camera"),
        camera=None if first is None else CameraModel(*pictures.size(first), intrinsics[0]),
        base_T_flange=np.array(base_T_flange),
        camera_T_target=np.array(camera_T_target),
        images=tuple(images) if first else None,
        folder=path,
        notes=(f"{path}: object {wanted} is the target, the reported camera pose stands for the flange",),
    )


def _pose(values: Any, rotation: str, translation: str, file: Path, key: str) -> Array:
    matrix = finite(item(values, rotation, file), f"{file}: {key}: {rotation}", (3, 3))
    millimetres = finite(item(values, translation, file), f"{file}: {key}: {translation}", (3,))
    return se3.make(matrix, millimetres / 1e3)


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="bop",
        summary="a scene in the BOP format with camera poses (scene_camera.json, scene_gt.json)",
        sniff=sniff,
        load=load,
    )
