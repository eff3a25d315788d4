"""The fields of a recording without None."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from hecbench.errors import Refusal
from hecbench.lens import CameraModel
from hecbench.recording.terms import ImageSource, RobotDescription
from hecbench.se3 import Array
from hecbench.targets import Target

if TYPE_CHECKING:
    from hecbench.recording.recording import Recording


class Present:
    """The fields of a recording as values that are never None; one that is absent raises a `Refusal` with its name."""

    robot: RobotDescription
    camera: CameraModel
    target: Target
    initial_parent_T_camera: Array
    truth_parent_T_camera: Array
    base_T_flange: Array
    joints_rad: Array
    camera_T_target: Array
    corners_px: Array
    images: tuple[ImageSource, ...]
    masks: tuple[ImageSource, ...]
    depths: tuple[ImageSource, ...]
    folder: Path

    def __init__(self, recording: Recording) -> None:
        self._recording = recording

    def __getattr__(self, name: str) -> Any:
        if name not in Present.__annotations__:
            raise AttributeError(name)
        if (value := getattr(self._recording, name)) is None:
            raise Refusal(f"recording '{self._recording.name}' has no {name}")
        return value
