"""What the user says about data that does not say it itself: `hecbench-import.yaml` beside the data."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import msgspec
import numpy as np

from hecbench.errors import InputError
from hecbench.exchange.conventions import HINTS_NAME
from hecbench.lens import OPENCV, CameraModel
from hecbench.recording import Mounting
from hecbench.targets import DECLARED, ChessboardTarget, PointsTarget, Target
from hecbench_datasets.reading.sources import yaml_value


class Camera(msgspec.Struct, forbid_unknown_fields=True):
    """Intrinsics in px, OpenCV's convention."""

    width: int
    height: int
    K: list[list[float]] | None = None
    distortion: list[float] = []
    distortion_model: str = OPENCV

    def model(self) -> CameraModel:
        """As the recordings have it."""
        K = None if self.K is None else np.array(self.K, float)
        return CameraModel(
            self.width, self.height, K, np.array(self.distortion, float), self.distortion_model
        )


class Hints(msgspec.Struct, forbid_unknown_fields=True):
    """Every key is optional; what is given is believed, the rest is proven or as documented."""

    mounting: Mounting | None = None
    robot_pose: Literal["base_T_flange", "flange_T_base"] | None = None
    robot_rotation: str | None = None
    robot_unit: Literal["m", "cm", "mm"] | None = None
    target_pose: Literal["camera_T_target", "target_T_camera"] | None = None
    target_rotation: str | None = None
    target_unit: Literal["m", "cm", "mm"] | None = None
    time_offset_s: float | None = None
    robot: str | None = None
    base_link: str | None = None
    flange_link: str | None = None
    images: str | None = None
    camera: Camera | None = None
    target: dict[str, Any] | None = None

    def camera_model(self) -> CameraModel | None:
        """The camera, as recordings have it."""
        return None if self.camera is None else self.camera.model()


def hints_for(path: Path) -> tuple[Hints, Path]:
    """The hints beside a file or in a folder, empty without the file, and where they stand or would stand."""
    folder = path if path.is_dir() else path.parent
    file = folder / HINTS_NAME
    if not file.is_file():
        return Hints(), file
    try:
        return msgspec.convert(yaml_value(file) or {}, Hints), file
    except msgspec.ValidationError as error:
        raise InputError(f"{file}: {error}; see docs/adapters.md") from error


def hinted_target(hints: Hints, file: Path) -> Target | None:
    """The target of the hints: a kind of the recording format, or circles {columns, rows, spacing_m}."""
    if hints.target is None:
        return None
    values = dict(hints.target)
    kind = values.pop("kind", None)
    try:
        if kind == "circles":
            return circle_grid(**values)
        if kind == "points":
            return PointsTarget.of(np.array(values["points_m"], float).reshape(-1, 3))
        for known in DECLARED:
            if kind == known.kind:
                return known(**values)
    except (TypeError, KeyError, ValueError) as error:
        raise InputError(f"{file}: target: {error}") from error
    except InputError as error:
        raise InputError(f"{file}: {error}") from error
    kinds = ", ".join(known.kind for known in DECLARED)
    raise InputError(f"{file}: target.kind: '{kind}'; use {kinds}, circles or points")


def circle_grid(columns: int, rows: int, spacing_m: float) -> PointsTarget:
    """Centres of a circle grid, row by row, x along the columns, y along the rows, z = 0."""
    return PointsTarget.of(ChessboardTarget(columns, rows, spacing_m).points_m)
