"""Kalibr's YAML files: targets and camera chains.

Furgale, Rehder and Siegwart 2013, "Unified temporal and spatial calibration for multi-sensor systems". The keys are
those of Kalibr's wiki, pages "Calibration targets" and "Yaml formats".
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hecbench.errors import InputError
from hecbench.lens import EQUIDISTANT, OPENCV, CameraModel
from hecbench.targets import AprilGridTarget, ChessboardTarget, PointsTarget, Target
from hecbench_datasets.reading.sources import YAML_SUFFIXES, yaml_value

_KEYS = {"camera_model", "intrinsics"}
_LENSES = {"radtan": OPENCV, "equidistant": EQUIDISTANT, "none": OPENCV}


def target_in(files: list[Path], notes: list[str]) -> Target | None:
    """The target of the first file that describes one for Kalibr; `notes` then say which.

    Raises:
        InputError: a number of it is missing or wrong.
    """
    for file in files:
        if file.suffix.lower() not in YAML_SUFFIXES:
            continue
        try:
            content = yaml_value(file)
        except InputError:  # most YAML files of a folder are not for us
            continue
        if isinstance(content, Mapping) and "target_type" in content:
            notes.append(f"{file.parent}: target from {file.name}")
            return _target(content, file)
    return None


def _target(content: Mapping[str, Any], file: Path) -> Target:
    kind = content["target_type"]
    try:
        if kind == "aprilgrid":
            size, ratio = float(content["tagSize"]), float(content["tagSpacing"])
            return AprilGridTarget(int(content["tagCols"]), int(content["tagRows"]), size, ratio)
        columns, rows = int(content["targetCols"]), int(content["targetRows"])
        if kind == "checkerboard":
            across, down = float(content["colSpacingMeters"]), float(content["rowSpacingMeters"])
            if across == down:
                return ChessboardTarget(columns, rows, across)
            return PointsTarget.of(ChessboardTarget(columns, rows, 1.0).points_m * [across, down, 0.0])
        if kind == "circlegrid" and not content.get("asymmetricGrid", False):
            return PointsTarget.of(ChessboardTarget(columns, rows, float(content["spacingMeters"])).points_m)
    except KeyError as error:
        raise InputError(f"{file}: target_type '{kind}' needs {error.args[0]}") from None
    except (TypeError, ValueError, InputError) as error:
        raise InputError(f"{file}: {error}") from error
    raise InputError(
        f"{file}: target_type '{kind}' is not read; use aprilgrid, checkerboard or a symmetric circlegrid"
    )


def camera(content: Any, size: tuple[int, int]) -> CameraModel | None:
    """The camera of a chain (`cam0`, or the one of this size) or of one entry; None when it is not Kalibr's.

    Raises:
        InputError: its projection or its lens is none of ours, or its size is not that of the pictures.
    """
    if not isinstance(content, Mapping):
        return None
    chain = [entry for key, entry in content.items() if str(key).startswith("cam")]
    entries = [entry for entry in [*chain, content] if isinstance(entry, Mapping) and entry.keys() >= _KEYS]
    if not entries:
        return None
    fitting = [entry for entry in entries if tuple(entry.get("resolution", size)) == size]
    if not fitting:
        sizes = " and ".join("x".join(map(str, entry["resolution"])) for entry in entries)
        raise InputError(f"its intrinsics are of {sizes} px, the pictures have {size[0]}x{size[1]}")
    model, lens = fitting[0]["camera_model"], fitting[0].get("distortion_model", "none")
    if model != "pinhole" or lens not in _LENSES:
        raise InputError(
            f"camera_model '{model}' with distortion_model '{lens}' is not read; calibrate as pinhole with radtan or"
            " equidistant"
        )
    fx, fy, cx, cy = (float(number) for number in fitting[0]["intrinsics"])
    distortion = np.array(fitting[0].get("distortion_coeffs", []) if lens != "none" else [], float)
    return CameraModel(*size, np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]), distortion, _LENSES[lens])
