"""What the trials need of a cell, simulated or real, and the calibrations that are tried in it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from hecbench import se3
from hecbench.errors import HecbenchError
from hecbench.estimate import Estimate
from hecbench.se3 import Array
from hecbench_hardware.devices import Gripper, GripperStatus, Robot
from hecbench_hardware.trials import solids
from hecbench_hardware.trials.tasks import Task, Verdict


class NotSeen(HecbenchError):
    """The workpiece's tag gives no pose; the message says why and what to do."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """One answer of one method, and the place it is meant for.

    Attributes:
        name: of the calibration among those of its method.
        method: solver, or what made it.
        number: of the cell's calibrations, which says where the camera stands.
        base_T_camera: (4, 4) m.
        errors: against the truth, where it is known.
        estimate: where it came from, None for a made-up one.
    """

    name: str
    method: str
    number: int
    base_T_camera: Array
    errors: dict[str, float] = field(default_factory=dict)
    estimate: Estimate | None = None


@dataclass(frozen=True)
class Stroke:
    """What happened between approach and retreat, as the arm reported it."""

    base_T_tool: Array
    """(N, 4, 4) m, where the tool really was."""
    closed: GripperStatus
    """After closing."""
    lifted: GripperStatus
    """After the retreat."""


class TrialCell(Protocol):
    """A table with a workpiece, a camera, an arm and a gripper."""

    name: str
    robot: Robot
    gripper: Gripper
    shape: solids.Gripper
    home_rad: Array
    """Where the arm is out of the camera's view."""
    places: int
    """How many places of the workpiece there are."""

    def prepare(self, calibration: Calibration, place: int) -> None:
        """Put the workpiece at a place before the camera of a calibration."""
        ...

    def locate(self) -> Array:
        """camera_T_tag (4, 4) m; raises `NotSeen`, or `DeviceFault` when the camera fails."""
        ...

    def judge(self, task: Task, stroke: Stroke, clearance_m: float) -> Verdict:
        """Whether the stroke was a success."""
        ...

    def truth(self) -> tuple[Array, Array] | None:
        """base_T_workpiece and camera_T_tag (4, 4) m where they are known."""
        ...


def believed_workpiece(calibration: Calibration, camera_T_tag: Array) -> Array:
    """base_T_workpiece (4, 4) m by this calibration."""
    return np.asarray(calibration.base_T_camera @ camera_T_tag @ se3.inverse(solids.workpiece_T_tag()))
