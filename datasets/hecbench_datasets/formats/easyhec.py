"""EasyHeC offline examples (folder or zip): color/, mask/, qpos/, K.txt of a Franka Panda, camera fixed.

A ``Tc_c2b.txt``, camera_T_base, is the truth where there is one. No file names the robot: a URDF in the folder is
taken.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path, PurePosixPath

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import CameraModel, Image, ImageSource, Mounting, Recording, RobotDescription
from hecbench.registry import hookimpl
from hecbench.specs import DatasetSpec
from hecbench.system import files, pictures
from hecbench_datasets.reading.arms import PANDA
from hecbench_datasets.reading.robots import NO_START, urdf_beside
from hecbench_datasets.reading.sources import (
    files_in,
    finite,
    foreign,
    natural,
    table,
    zip_bytes,
    zip_names,
)

_TRUTH = "Tc_c2b.txt"


def _layout(path: Path) -> tuple[Path, str] | None:
    """Where K.txt, color/ and qpos/ are: a folder with prefix "", or an archive with the prefix inside it."""
    if path.is_dir() and (path / "K.txt").is_file() and (path / "qpos").is_dir():
        return path, ""
    for archive in [path] if path.suffix == ".zip" else files_in(path, ".zip"):
        names = zip_names(archive)
        for name in names:
            prefix = name.removesuffix("K.txt")
            if prefix != name and any(other.startswith(f"{prefix}qpos/") for other in names):
                return archive, prefix
    return None


def sniff(path: Path) -> bool:
    """A folder or archive with K.txt and qpos/."""
    return _layout(path) is not None


@foreign
def load(path: Path) -> Recording:
    """Read joints, intrinsics and pictures; those of an archive are decoded here, those of a folder later."""
    layout = _layout(path)
    if layout is None:
        raise InputError(f"{path}: holds no K.txt with qpos/ and color/ beside it")
    place, prefix = layout
    names = _names(place, prefix)
    read: Callable[[str], bytes] = (
        (lambda name: files.read_bytes(place / name))
        if place.is_dir()
        else (lambda name: zip_bytes(place, prefix + name))
    )

    def sources(kind: str, decode: Callable[[bytes, str], Image]) -> tuple[ImageSource, ...]:
        by_id = {PurePosixPath(name).stem: name for name in names if name.startswith(f"{kind}/")}
        found: list[ImageSource] = []
        for sample_id in ids:
            name = by_id.get(sample_id)
            if name is None or place.is_dir():
                found.append(None if name is None else place / name)
            else:
                found.append(decode(read(name), f"{place}: {name}"))
        return tuple(found)

    ids = [PurePosixPath(name).stem for name in names if name.startswith("qpos/")]
    rows = [table(read(f"qpos/{i}.txt").decode("utf-8", "replace"), f"{place}: qpos/{i}.txt") for i in ids]
    joints = finite([row.ravel()[:7] for row in rows], f"{place}: qpos", (-1, 7))
    K = finite(table(read("K.txt").decode("utf-8", "replace"), f"{place}: K.txt"), f"{place}: K.txt", (3, 3))
    truth = None
    if (_TRUTH in names) if not place.is_dir() else (place / _TRUTH).is_file():
        written = table(read(_TRUTH).decode("utf-8", "replace"), f"{place}: {_TRUTH}")
        truth = se3.inverse(finite(written, f"{place}: {_TRUTH}", (4, 4)))
    folder = path if path.is_dir() else path.parent
    urdf, notes = urdf_beside(folder, "a Franka Panda")
    images, masks = sources("color", pictures.image), sources("mask", _mask)
    return Recording(
        name="easyhec_" + (prefix.rstrip("/") or place.resolve().name),
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=tuple(ids),
        robot=RobotDescription(
            urdf=urdf,
            base_link=PANDA.base_link,
            flange_link=PANDA.flange_link,
            joint_names=PANDA.joint_names,
        ),
        truth_parent_T_camera=truth,
        camera=CameraModel(*_size(images, place), K),
        joints_rad=joints,
        images=images,
        masks=masks,
        folder=folder,
        notes=(*notes, NO_START.format(path)),
    )


def _mask(content: bytes, where: str) -> Image:
    return pictures.mask(content, where).astype(np.uint8) * np.uint8(255)


def _names(place: Path, prefix: str) -> list[str]:
    if place.is_dir():
        found = [f"{kind}/{p.name}" for kind in ("qpos", "color", "mask") for p in (place / kind).glob("*.*")]
    else:
        found = [name.removeprefix(prefix) for name in zip_names(place) if name.startswith(prefix)]
    return sorted(found, key=natural)


def _size(images: tuple[ImageSource, ...], place: Path) -> tuple[int, int]:
    first = next((image for image in images if image is not None), None)
    if first is None:
        raise InputError(f"{place}: color/ holds no picture for any qpos/")
    return pictures.size(first) if isinstance(first, Path) else (first.shape[1], first.shape[0])


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="easyhec",
        summary="EasyHeC offline example: color/, mask/, qpos/, K.txt of a Panda (folder or zip)",
        sniff=sniff,
        load=load,
    )
