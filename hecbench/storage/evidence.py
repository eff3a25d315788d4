"""What a report shows of a recording beside the numbers: poses, corners, findings and a few small pictures.

A run keeps one file per recording beside its store, so that the report needs nothing else and runs nothing.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from hecbench.errors import InputError
from hecbench.lens import OPENCV, CameraModel
from hecbench.recording import Mounting, Recording
from hecbench.samples.spread import evenly
from hecbench.se3 import Array
from hecbench.system import files

FOLDER = "evidence"
_PICTURES = 3
_WIDEST_PX = 640
_ARRAYS = ("base_T_flange", "camera_T_target", "corners_px", "points_m", "K", "distortion", "influence_mm")


@dataclass(frozen=True, eq=False)
class Evidence:
    """Of one recording; arrays as in `Recording`, None where absent.

    Attributes:
        sha256: of the recording.
        mounting: of the camera.
        sample_ids: N names.
        size: width and height of the image, px.
        findings: of `check`, as JSON.
        pictures: sample index -> encoded JPEG, at most `_WIDEST_PX` wide.
        influence_mm: (N,) how far the answer moves without each sample, NaN where unknown.
    """

    sha256: str
    mounting: Mounting
    sample_ids: tuple[str, ...]
    size: tuple[int, int] | None
    findings: list[dict[str, Any]]
    pictures: dict[int, bytes]
    base_T_flange: Array | None = None
    camera_T_target: Array | None = None
    corners_px: Array | None = None
    points_m: Array | None = None
    K: Array | None = None
    distortion: Array | None = None
    distortion_model: str = OPENCV
    influence_mm: Array | None = None

    @property
    def camera(self) -> CameraModel | None:
        """The camera, when its intrinsics are known."""
        if self.size is None or self.K is None:
            return None
        distortion = np.zeros(0) if self.distortion is None else self.distortion
        return CameraModel(*self.size, self.K, distortion, self.distortion_model)


def collect(
    recording: Recording, sha256: str, findings: Sequence[dict[str, Any]], influence_mm: Array | None
) -> Evidence:
    """The evidence of a recording whose poses and corners are computed; unreadable pictures are left out."""
    camera, target = recording.camera, recording.target
    return Evidence(
        sha256=sha256,
        mounting=recording.mounting,
        sample_ids=recording.sample_ids,
        size=(camera.width, camera.height) if camera else None,
        findings=list(findings),
        pictures=_pictures(recording),
        base_T_flange=recording.base_T_flange,
        camera_T_target=recording.camera_T_target,
        corners_px=recording.corners_px,
        points_m=target.points_m if target else None,
        K=camera.K if camera else None,
        distortion=camera.distortion if camera else None,
        distortion_model=camera.distortion_model if camera else OPENCV,
        influence_mm=influence_mm,
    )


def _pictures(recording: Recording) -> dict[int, bytes]:
    """A few samples spread over the recording."""
    from PIL import Image

    pictures = {}
    for index in evenly(len(recording), _PICTURES).tolist():
        if recording.images is None or recording.images[index] is None:
            continue
        try:
            picture = Image.fromarray(recording.image(index))
        except InputError:  # the report shows what can be shown; `check` names damaged images
            continue
        picture.thumbnail((_WIDEST_PX, _WIDEST_PX))
        stream = io.BytesIO()
        picture.save(stream, "JPEG", quality=80)
        pictures[index] = stream.getvalue()
    return pictures


def _path(folder: Path, sha256: str) -> Path:
    return folder / FOLDER / f"{sha256[:16]}.npz"


def save(evidence: Evidence, folder: Path) -> None:
    """Write it beside the store in `folder`, whole or not at all."""
    described = {
        "sha256": evidence.sha256,
        "mounting": evidence.mounting,
        "sample_ids": evidence.sample_ids,
        "size": evidence.size,
        "distortion_model": evidence.distortion_model,
        "findings": evidence.findings,
    }
    content: dict[str, Any] = {"description": np.frombuffer(msgspec.json.encode(described), np.uint8)}
    content |= {name: getattr(evidence, name) for name in _ARRAYS if getattr(evidence, name) is not None}
    content |= {f"picture_{i}": np.frombuffer(jpeg, np.uint8) for i, jpeg in evidence.pictures.items()}
    with files.replacing(_path(folder, evidence.sha256)) as stream:
        np.savez_compressed(stream, **content)


def load(folder: Path, sha256: str) -> Evidence | None:
    """The evidence of a recording, or None when the run kept none."""
    path = _path(folder, sha256)
    if not path.exists():
        return None
    try:
        with np.load(path, allow_pickle=False) as archive:
            content = {name: archive[name] for name in archive.files}
        described = msgspec.json.decode(content["description"].tobytes())
    except (ValueError, OSError, KeyError, EOFError, zipfile.BadZipFile, msgspec.DecodeError) as error:
        raise InputError(
            f"{path}: cannot be read ({error}); remove it and run again with --resume"
        ) from error
    prefix = "picture_"
    return Evidence(
        sha256=described["sha256"],
        mounting=Mounting(described["mounting"]),
        sample_ids=tuple(described["sample_ids"]),
        size=described["size"] and tuple(described["size"]),
        distortion_model=described.get("distortion_model", OPENCV),
        findings=described["findings"],
        pictures={int(n.removeprefix(prefix)): content[n].tobytes() for n in content if n.startswith(prefix)},
        **{name: content.get(name) for name in _ARRAYS},
    )
