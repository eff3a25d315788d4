"""An episode of a LeRobot dataset (v2.1, v3.0): ``ROOT/episode_000003`` or ``ROOT/CAMERA/episode_000003``.

Joints from `observation.state`, a few frames of one camera: slow ones, far from each other. A camera whose key says
wrist, hand or gripper is on the hand, the others are fixed; nobody's intrinsics are in such a set.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError
from hecbench.exchange.conventions import HINTS_NAME
from hecbench.recording import CameraModel, Mounting, Recording
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import DatasetSpec
from hecbench_datasets.reading.hints import Hints, hinted_target, hints_for
from hecbench_datasets.reading.joint_poses import joint_readings
from hecbench_datasets.reading.lerobot_files import Episode, cameras, description, episode, is_dataset
from hecbench_datasets.reading.sources import foreign

FRAMES = 10
"""Views of an episode: the markerless methods gain little from more."""
_SLOW_SHARE = 0.4
"""Of the frames, the slowest: pictures and joints are some hundredths of a second apart."""
_RADIANS_BELOW = 7.0
_STILL_RAD_S = 1e-3
_EPISODE = re.compile(r"episode_(\d+)$")
_ON_HAND = re.compile(r"wrist|hand|gripper|eef", re.IGNORECASE)
_STRIDE, _BLOCK = 4, 8
_TEXTURE = 3.0
"""Grey levels that neighbours differ by on average."""
_COHERENT = 0.8
_LEAST_TEXTURED, _LEAST_FIXED = 0.3, 0.15
"""Shares of blocks: with texture, and of these fixed. Fixed lab cameras have 0.66 to 0.85, shifted ones 0 to 0.07."""


def parts(path: Path) -> tuple[Path, str | None, int | None] | None:
    """Root, camera and number of an episode's path; None when it is not in a LeRobot dataset."""
    if is_dataset(path):
        return path, None, None
    match = _EPISODE.match(path.name)
    for root, camera in ((path.parent, None), (path.parent.parent, path.parent.name)):
        if match and is_dataset(root):
            return root, camera, int(match[1])
    return None


def sniff(path: Path) -> bool:
    """A dataset's root, or an episode's name in it."""
    return parts(path) is not None


@foreign
def load(path: Path) -> Recording:
    """Read the joints, and decode the chosen frames."""
    found = parts(path)
    if found is None:
        raise InputError(f"{path}: is no episode of a LeRobot dataset, such as ROOT/episode_000000")
    root, named, index = found
    info = description(root)
    hints, hints_file = hints_for(root)
    if index is None:
        if int(info["total_episodes"]) > 1:
            raise InputError(
                f"{root}: holds {info['total_episodes']} episodes; name one, such as {root / 'episode_000000'}, or "
                f"calibrate all: hecbench episodes {root}"
            )
        index = 0
    camera = camera_key(root, info, named or hints.images)
    recorded = episode(root, info, index)
    source = f"{root}: episode {index}"
    joints, names = _joints(recorded)
    robots = sorted(root.glob("*.urdf")) if hints.robot is None else [_robot(root, hints.robot)]
    units = ("rad",) if np.abs(joints).max() < _RADIANS_BELOW else ("deg",)
    reading = joint_readings(joints, names, robots or _of_type(root, info), units)
    if len(reading) > 1:
        fitting = ", ".join(str((one.robot and one.robot.source) or "panda") for one in reading)
        raise InputError(
            f"{source}: its joints fit {fitting}; write robot: NAME or robot: FILE.urdf into {hints_file}"
        )
    rows = _chosen(joints, recorded.stamps)
    images = recorded.picture(camera, rows)
    mounting = hints.mounting or (Mounting.EYE_IN_HAND if _ON_HAND.search(camera) else Mounting.EYE_TO_HAND)
    if mounting is Mounting.EYE_TO_HAND and moves(images):
        raise InputError(
            f"{source}: {camera} moves: nothing in its pictures stays where it is; write mounting: eye_in_hand into "
            f"{hints_file} if it is on the hand, or leave the episode out"
        )
    notes = [] if hints.mounting else [f"{source}: {camera} read as {mounting}, by its name"]
    if hints.camera is None:
        notes.append(f"{source}: no file of the set holds intrinsics: write camera into {HINTS_NAME}")
    chosen = reading[0].at(rows)
    return Recording(
        name=f"{root.resolve().name}_{camera.split('.')[-1]}_{index:06d}",
        mounting=mounting,
        sample_ids=tuple(f"{row:06d}" for row in rows),
        robot=chosen.robot,
        camera=_camera(hints, images[0]),
        target=hinted_target(hints, hints_file),
        base_T_flange=chosen.base_T_flange,
        joints_rad=chosen.joints_rad,
        camera_stamp_s=recorded.stamps[rows],
        robot_stamp_s=recorded.stamps[rows],
        images=tuple(images),
        folder=root,
        notes=tuple(notes),
    )


def camera_key(root: Path, info: dict[str, object], wanted: str | None) -> str:
    """The key of the camera that is wanted, or the only one.

    Raises:
        InputError: there are several, or none of that name.
    """
    keys = cameras(info)
    fitting = [key for key in keys if wanted in (None, key, key.split(".")[-1])]
    if len(fitting) == 1:
        return fitting[0]
    reason = f"has no camera '{wanted}'" if wanted and not fitting else f"has {len(keys)} cameras"
    raise InputError(f"{root}: {reason}: {', '.join(keys) or 'none'}; write images: KEY into {HINTS_NAME}")


def _joints(recorded: Episode) -> tuple[Array, tuple[str, ...]]:
    """The state without the gripper's columns."""
    kept = [i for i, name in enumerate(recorded.names) if not re.search("grip|finger", name, re.IGNORECASE)]
    return recorded.state[:, kept], tuple(recorded.names[i] for i in kept)


def _robot(root: Path, name: str) -> str | Path:
    return root / name if name.endswith(".urdf") else name


def _of_type(root: Path, info: dict[str, object]) -> list[str | Path]:
    kind = str(info.get("robot_type") or "").lower()
    known = [
        name for name in ("ur3e", "ur5e", "panda") if name in kind or (name == "panda" and "franka" in kind)
    ]
    return list(known)


def _camera(hints: Hints, image: NDArray[np.uint8]) -> CameraModel:
    return hints.camera_model() or CameraModel(image.shape[1], image.shape[0])


def _chosen(joints: Array, stamps: Array) -> list[int]:
    """Rows of slow frames far from each other: farthest points in the space of joints (Gonzalez 1985)."""
    speed = np.abs(np.gradient(joints, stamps, axis=0)).max(1) if len(joints) > 2 else np.zeros(len(joints))
    slow = np.flatnonzero(speed <= np.quantile(speed, _SLOW_SHARE) + _STILL_RAD_S)
    kept = [int(slow[0])]
    while len(kept) < min(FRAMES, len(slow)):
        distance = np.linalg.norm(joints[slow, None] - joints[kept], axis=2).min(1)
        if distance.max() < 1e-3:
            break
        kept.append(int(slow[distance.argmax()]))
    return sorted(kept)


def moves(images: list[NDArray[np.uint8]]) -> bool:
    """Whether the pictures show that their camera moved: edges are nowhere at the same place in all of them.

    In blocks with texture the mean gradient is compared with the mean of the gradients' sizes: about 0.9 behind a robot
    before a fixed camera, about 0.6 when all moves. A scene without texture shows nothing.
    """
    greys = np.array([image[::_STRIDE, ::_STRIDE].mean(2) for image in images])
    gradients = np.stack([np.diff(greys, axis=1)[:, :, :-1], np.diff(greys, axis=2)[:, :-1]], -1)
    sizes = np.abs(gradients).mean(0).sum(-1)
    together = np.abs(gradients.mean(0)).sum(-1)
    height, width = (side // _BLOCK * _BLOCK for side in sizes.shape)
    size, same = (
        part[:height, :width].reshape(height // _BLOCK, _BLOCK, -1, _BLOCK).mean((1, 3))
        for part in (sizes, together)
    )
    textured = size > _TEXTURE
    fixed = (same > _COHERENT * size) & textured
    return len(images) > 2 and bool(
        textured.mean() > _LEAST_TEXTURED and fixed.sum() < _LEAST_FIXED * textured.sum()
    )


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="lerobot",
        summary="an episode of a LeRobot dataset (v2.1, v3.0): ROOT/episode_000000; joints and frames of one camera",
        sniff=sniff,
        load=load,
        imports=("pyarrow", "av"),
    )
