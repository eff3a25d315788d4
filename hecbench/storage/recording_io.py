"""The native recording folder, schema ``hecbench.recording/1``: read strictly, write atomically."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError
from hecbench.estimate import plain
from hecbench.lens import CameraModel
from hecbench.recording import ImageSource, Recording, RobotDescription
from hecbench.robots import urdf_files
from hecbench.storage.recording_pictures import store_pictures
from hecbench.storage.recording_schema import (
    SCHEMA,
    CameraJson,
    PointsJson,
    RecordingJson,
    RobotJson,
    SampleJson,
    TargetJson,
)
from hecbench.system import files
from hecbench.targets import DECLARED, PointsTarget, Target

FILE_NAME = "recording.json"
ARRAYS_NAME = "samples.npz"

_DECODER = msgspec.json.Decoder(RecordingJson)
_ARRAYS = {
    "robot_stamp_s": (),
    "camera_stamp_s": (),
    "base_T_flange": (4, 4),
    "joints_rad": None,
    "camera_T_target": (4, 4),
    "corners_px": None,
}
"""Per-sample arrays and the shape of one row; None: the shape of the first row given."""


def is_recording(path: Path) -> bool:
    """Whether this is a native recording folder or its JSON file."""
    return (path / FILE_NAME).is_file() or (path.is_file() and path.name == FILE_NAME)


def load(path: str | Path) -> Recording:
    """Read a recording folder (or its JSON file). No image is decoded, and images may be absent.

    Raises:
        InputError: with the file, the key, the value and the cure.
    """
    path = Path(path)
    file = path if path.name == FILE_NAME and not path.is_dir() else path / FILE_NAME
    content = files.read_bytes(file)
    try:
        parsed = _DECODER.decode(content)
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise InputError(f"{file}: {error}; see docs/recording-format.md") from error
    except RecursionError:
        raise InputError(f"{file}: is nested too deeply to be a recording") from None
    try:
        return _build(parsed, file.parent)
    except InputError as error:
        raise InputError(f"{file}: {error}") from error


def _build(parsed: RecordingJson, folder: Path) -> Recording:
    from_file = _read_arrays(folder / ARRAYS_NAME, len(parsed.samples))
    arrays: dict[str, Any] = {name: _stack(name, shape, parsed.samples) for name, shape in _ARRAYS.items()}
    for name in from_file:
        if arrays[name] is not None:
            raise InputError(f"samples[].{name}: stands in {ARRAYS_NAME} too; keep one of the two")
    arrays |= from_file
    return Recording(
        name=parsed.name,
        mounting=parsed.mounting,
        sample_ids=tuple(sample.id for sample in parsed.samples),
        robot=_robot(parsed.robot, folder),
        camera=_camera(parsed.camera),
        target=_target(parsed.target),
        initial_parent_T_camera=_optional_array("initial_parent_T_camera", parsed.initial_parent_T_camera),
        truth_parent_T_camera=_optional_array("truth_parent_T_camera", parsed.truth_parent_T_camera),
        images=_sources(folder, "image", [sample.image for sample in parsed.samples]),
        masks=_sources(folder, "mask", [sample.mask for sample in parsed.samples]),
        depths=_sources(folder, "depth", [sample.depth for sample in parsed.samples]),
        folder=folder,
        **arrays,
    )


def _robot(parsed: RobotJson | None, folder: Path) -> RobotDescription | None:
    if parsed is None:
        return None
    return RobotDescription(
        model=parsed.model,
        urdf=_inside(folder, "robot.urdf", parsed.urdf) if parsed.urdf else None,
        base_link=parsed.base_link or "base",
        flange_link=parsed.flange_link or "tool0",
        joint_names=tuple(parsed.joint_names or ()),
    )


def _camera(parsed: CameraJson | None) -> CameraModel | None:
    if parsed is None:
        return None
    K = _optional_array("camera.K", parsed.K)
    distortion = np.array(parsed.distortion or [], float)
    return CameraModel(parsed.width, parsed.height, K, distortion, parsed.distortion_model)


def _target(parsed: TargetJson | None) -> Target | None:
    match parsed:
        case None:
            return None
        case PointsJson(points_m=points_m):
            return PointsTarget(tuple(tuple(point) for point in points_m))
        case _:
            given = {key: value for key, value in msgspec.structs.asdict(parsed).items() if value is not None}
            kinds = {target.kind: target for target in DECLARED}
            return kinds[str(parsed.__struct_config__.tag)](**given)


def _array(name: str, value: Any) -> NDArray[np.float64]:
    try:
        return np.array(value, float)
    except ValueError:
        raise InputError(f"{name}: its rows have different lengths; write a rectangular list") from None


def _optional_array(name: str, value: Any) -> NDArray[np.float64] | None:
    return None if value is None else _array(name, value)


def _stack(name: str, shape: tuple[int, ...] | None, samples: list[SampleJson]) -> NDArray[np.float64] | None:
    """One array over all samples, NaN where a sample lacks it."""
    given = {
        i: getattr(sample, name) for i, sample in enumerate(samples) if getattr(sample, name) is not None
    }
    rows = {i: _row(f"samples[{i}].{name}", value) for i, value in given.items()}
    if not rows:
        return None
    if shape is None:
        shape = next(iter(rows.values())).shape
    stacked = np.full((len(samples), *shape), np.nan)
    for i, row in rows.items():
        if row.shape != shape:
            raise InputError(f"samples[{i}].{name}: shape {row.shape}, expected {shape}")
        stacked[i] = row
    return stacked


def _row(name: str, value: Any) -> NDArray[np.float64]:
    if isinstance(value, list) and None in value:
        value = [[np.nan, np.nan] if point is None else point for point in value]
    return _array(name, value)


def _read_arrays(path: Path, sample_count: int) -> dict[str, NDArray[np.float64]]:
    if not path.exists():
        return {}
    try:
        with np.load(io.BytesIO(files.read_bytes(path)), allow_pickle=False) as archive:
            arrays = {name: np.asarray(archive[name]) for name in archive.files}
    except (ValueError, OSError, EOFError, KeyError, zipfile.BadZipFile) as error:
        raise InputError(
            f"{path.name}: is not a readable .npz ({error}); write it with numpy.savez"
        ) from error
    for name, array in arrays.items():
        if name not in _ARRAYS:
            raise InputError(f"{path.name}: unknown array '{name}'; known are {', '.join(_ARRAYS)}")
        if array.ndim == 0 or array.shape[0] != sample_count or not np.issubdtype(array.dtype, np.number):
            raise InputError(
                f"{path.name}: '{name}' has shape {array.shape} of {array.dtype}, "
                f"expected numbers with first axis {sample_count}, the number of samples"
            )
    return {name: np.asarray(array, float) for name, array in arrays.items()}


def _sources(folder: Path, key: str, names: list[str | None]) -> tuple[ImageSource, ...] | None:
    if all(name is None for name in names):
        return None
    return tuple(
        None if name is None else _inside(folder, f"samples[{i}].{key}", name) for i, name in enumerate(names)
    )


def _inside(folder: Path, key: str, name: str) -> Path:
    try:
        path = (folder / name).resolve()
    except (OSError, ValueError, RuntimeError) as error:
        raise InputError(f"{key}: {name!r} is not a usable path ({error})") from error
    if not path.is_relative_to(folder.resolve()):
        raise InputError(f"{key}: {name!r} leaves the recording's folder; copy the file into the folder")
    return path


def save(recording: Recording, folder: str | Path) -> None:
    """Write a recording folder; images and masks in memory or elsewhere are stored as PNG or copied in.

    The JSON file is written last and atomically, so a folder with `recording.json` is complete.
    """
    folder = Path(folder)
    images = store_pictures(recording.images, folder, "images", recording.sample_ids)
    masks = store_pictures(recording.masks, folder, "masks", recording.sample_ids)
    depths = store_pictures(recording.depths, folder, "depths", recording.sample_ids)
    samples = [
        {"id": recording.sample_ids[i]}
        | {name: _sample_value(getattr(recording, name), i) for name in _ARRAYS}
        | {"image": images[i], "mask": masks[i], "depth": depths[i]}
        for i in range(len(recording))
    ]
    robot = recording.robot and {
        "model": recording.robot.model,
        "urdf": recording.robot.urdf and _copied_robot(recording.robot.urdf, folder),
        "base_link": recording.robot.base_link,
        "flange_link": recording.robot.flange_link,
        "joint_names": recording.robot.joint_names,
    }
    camera = recording.camera and {
        "width": recording.camera.width,
        "height": recording.camera.height,
        "K": recording.camera.K,
        "distortion": recording.camera.distortion,
        "distortion_model": recording.camera.distortion_model,
    }
    content = {
        "schema": SCHEMA,
        "name": recording.name,
        "mounting": recording.mounting,
        "robot": robot,
        "camera": camera,
        "target": target_json(recording.target),
        "initial_parent_T_camera": recording.initial_parent_T_camera,
        "truth_parent_T_camera": recording.truth_parent_T_camera,
        "samples": [{key: value for key, value in sample.items() if value is not None} for sample in samples],
    }
    files.write_bytes(folder / FILE_NAME, msgspec.json.encode(plain(content)) + b"\n")


def _sample_value(array: NDArray[np.float64] | None, index: int) -> Any:
    """One row as JSON: None when absent, and None for each target point not seen."""
    if array is None or np.isnan(array[index]).all():
        return None
    row = array[index]
    return [None if np.isnan(point).any() else point for point in row] if np.isnan(row).any() else row


def target_json(target: Target | None) -> dict[str, Any] | None:
    """A target as the recording's JSON describes it."""
    match target:
        case None:
            return None
        case PointsTarget():
            return {"kind": target.kind, "points_m": plain(target.points_m)}
        case _:
            declared = [name for name in target.__annotations__ if name != "kind"]
            return {"kind": target.kind} | {name: getattr(target, name) for name in declared}


def _copied_robot(urdf: Path, folder: Path) -> str:
    """The path of a URDF relative to the folder, copied in with its meshes when it lies outside."""
    if not urdf.resolve().is_relative_to(folder.resolve()):
        urdf = urdf_files.copy(urdf, folder / "robot")
    return urdf.resolve().relative_to(folder.resolve()).as_posix()
