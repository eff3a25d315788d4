"""How much of what a calibration needs is recorded: parts of the picture, distances, rotations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hecbench.diagnose.rotation_diversity import GOOD_SECOND_AXIS_DEG, LEAST_ANGLE_DEG, turns_deg
from hecbench.lens import CameraModel
from hecbench.se3 import Array
from hecbench_hardware.cockpit.seeing import Seen

PARTS = 3
"""Of the picture, across and down."""


@dataclass(frozen=True, eq=False)
class Coverage:
    """Of the samples so far.

    Attributes:
        samples: how many.
        with_target: in how many the target is seen; None for a cell without one.
        parts: (3, 3) which parts of the picture the target's middle was in.
        largest_deg: between two of the robot's poses.
        second_axis_deg: rms rotation about the second principal axis; 0 before the third sample.
        distances_m: of the target, nearest and farthest; None while they are not known.
    """

    samples: int
    with_target: int | None
    parts: NDArray[np.bool_]
    largest_deg: float
    second_axis_deg: float
    distances_m: tuple[float, float] | None

    @property
    def turned_enough(self) -> bool:
        """Whether the hand turned about two axes as a marker calibration needs it."""
        return self.largest_deg >= LEAST_ANGLE_DEG and self.second_axis_deg >= GOOD_SECOND_AXIS_DEG

    def lines(self) -> list[str]:
        """Sentences, what is missing last."""
        said = [f"{self.samples} samples" if self.samples != 1 else "1 sample"]
        if self.with_target is not None:
            said[0] += f", the target seen in {self.with_target}"
            said.append(
                f"the target was in {int(self.parts.sum())} of {self.parts.size} parts of the picture"
            )
        if self.samples >= 2:
            axes = f", {self.second_axis_deg:.0f} deg rms about the second axis" if self.samples > 2 else ""
            said.append(f"the hand turned by up to {self.largest_deg:.0f} deg{axes}")
        if self.distances_m is not None:
            said.append(f"the target was {self.distances_m[0]:.2f} to {self.distances_m[1]:.2f} m away")
        if self.with_target is not None and self.samples > 2 and not self.turned_enough:
            said.append("turn the hand more, about two different axes")
        return said


def of(
    base_T_flange: Array, seen: Sequence[Seen | None], camera: CameraModel | None, has_target: bool
) -> Coverage:
    """The coverage of samples with flange poses (N, 4, 4)."""
    parts = np.zeros((PARTS, PARTS), bool)
    found = [one for one in seen if one is not None]
    if camera is not None:
        for one in found:
            u, v = np.nanmean(one.corners_px, axis=0)
            row, column = int(PARTS * v / camera.height), int(PARTS * u / camera.width)
            parts[np.clip(row, 0, PARTS - 1), np.clip(column, 0, PARTS - 1)] = True
    largest, second = turns_deg(base_T_flange[:, :3, :3]) if len(base_T_flange) > 1 else (0.0, 0.0)
    away = [float(np.linalg.norm(o.camera_T_target[:3, 3])) for o in found if o.camera_T_target is not None]
    return Coverage(
        len(base_T_flange),
        len(found) if has_target else None,
        parts,
        largest,
        second,
        (min(away), max(away)) if away else None,
    )
