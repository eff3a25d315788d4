"""Intrinsics in files that people keep beside their pictures: camera_info, Kalibr, OpenCV's YAML, JSON, NPZ, K.txt."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hecbench.errors import InputError
from hecbench.lens import EQUIDISTANT, OPENCV, CameraModel
from hecbench.se3 import Array
from hecbench.system import pictures
from hecbench_datasets.reading import kalibr
from hecbench_datasets.reading.sources import YAML_SUFFIXES, json_value, text, yaml_value
from hecbench_datasets.reading.tables import numpy_arrays

_FILE = re.compile(r"intrinsic|cam|calib|^k$|param|config|settings|_k$|mtx", re.IGNORECASE)
_SUFFIXES = (".json", ".txt", ".npz", ".npy", ".csv", *YAML_SUFFIXES)
_MATRIX = re.compile(
    r"^(k|mtx|(\w*_)?(camera_?matrix|intrinsics?|intrinsic_?matrix|cam_?k|camera_?k|k_?matrix))$"
)
_DISTORTION = re.compile(r"^(d|dist|(\w*_)?(dist_?coeffs?|distortion\w*|dist_?coefficients))$")
_FISHEYE = ("equidistant", "fisheye", "kannala_brandt4", "kannala_brandt", "opencv_fisheye")
_SIZE = (re.compile(r"^(image_?)?width|^w$|^cols$"), re.compile(r"^(image_?)?height|^h$|^rows$"))


def camera_in(files: list[Path], picture: Path) -> tuple[CameraModel | None, list[str]]:
    """The camera of the first file with intrinsics in px of such pictures, and notes: that file, or why one is not."""
    passed = []
    for file in files:
        if file.suffix.lower() not in _SUFFIXES or not _FILE.search(file.stem):
            continue
        try:
            camera = camera_of(_content(file), pictures.size(picture))
        except InputError as error:
            passed.append(f"{file.parent}: {file.name} is not used: {error}")
            continue
        if camera is not None:
            return camera, [f"{file.parent}: intrinsics from {file.name}"]
    return None, passed


def camera_of(content: Any, size: tuple[int, int]) -> CameraModel | None:
    """The camera that a mapping, or a bare 3x3 matrix, describes; None when it does not.

    Args:
        content: with K (or fx, fy, cx, cy), distortion, width and height under any of their usual names.
        size: width and height in px, where the content has none.
    """
    if (of_kalibr := kalibr.camera(content, size)) is not None:
        return of_kalibr
    named = list(_named(content))
    K = next((m for key, value in named if _MATRIX.match(key) and (m := _matrix(value)) is not None), None)
    if K is None:
        focal = {key: value for key, value in named if key in ("fx", "fy", "cx", "cy") and np.isscalar(value)}
        if len(focal) < 4:
            return None
        K = np.array([[focal["fx"], 0, focal["cx"]], [0, focal["fy"], focal["cy"]], [0, 0, 1]], float)
    lens = next(
        (d for key, value in named if _DISTORTION.match(key) and (d := _numbers(value)) is not None),
        np.zeros(0),
    )
    width, height = (
        next(
            (int(value) for key, value in named if words.match(key) and isinstance(value, int | float)), usual
        )
        for words, usual in zip(_SIZE, size, strict=True)
    )
    if (width, height) != size:
        raise InputError(f"its intrinsics are of {width}x{height} px, the pictures have {size[0]}x{size[1]}")
    model = next((value for key, value in named if key in ("distortion_model", "lens_model")), None)
    fisheye = isinstance(model, str) and model.lower() in _FISHEYE
    return CameraModel(width, height, K, lens[:4] if fisheye else lens, EQUIDISTANT if fisheye else OPENCV)


def _content(file: Path) -> Any:
    suffix = file.suffix.lower()
    if suffix == ".json":
        return json_value(file)
    if suffix in YAML_SUFFIXES:
        return yaml_value(file)
    if suffix in (".npz", ".npy"):
        return numpy_arrays(file)
    words = re.split(r"[\s,;\[\]]+", text(file).strip())
    return {"k": [float(word) for word in words if word]}


def _named(content: Any, depth: int = 0) -> Iterator[tuple[str, Any]]:
    """Keys in small letters and their values, outer ones first."""
    if isinstance(content, Mapping):
        yield from ((str(key).lower(), value) for key, value in content.items())
        for value in content.values():
            if depth < 3:
                yield from _named(value, depth + 1)


def _numbers(value: Any) -> Array | None:
    value = value.get("data", value.get("coefficients")) if isinstance(value, Mapping) else value
    try:
        numbers = np.asarray(value, float).ravel()
    except (TypeError, ValueError):
        return None
    return numbers if np.isfinite(numbers).all() and len(numbers) in (0, 4, 5, 8, 12, 14) else None


def _matrix(value: Any) -> Array | None:
    value = value.get("data") if isinstance(value, Mapping) else value
    try:
        K = np.asarray(value, float).reshape(3, 3)
    except (TypeError, ValueError):
        return None
    return K if np.isfinite(K).all() and K[0, 0] > 1 and np.allclose(K[2], [0, 0, 1]) else None
