"""Poses in a left-handed frame, as game engines have them, turned right-handed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from hecbench.exchange.pose_numbers import PoseConvention

_MIRROR = np.array([1.0, -1.0, 1.0, 1.0])


def mirrored(usual: Sequence[PoseConvention]) -> Iterator[tuple[str, list[PoseConvention]]]:
    """Readings in the other handedness, and what was done to them: all of it, or the sign of one axis."""
    yield (
        "the y axis of one of the two is turned round: one is left-handed (Unity, Unreal); write it in a right-handed "
        "frame",
        [replace(reading, poses=reading.poses * np.outer(_MIRROR, _MIRROR)) for reading in usual],
    )
    for axis, letter in enumerate("xyz"):
        turned = [reading.poses.copy() for reading in usual]
        for poses in turned:
            poses[:, axis, 3] *= -1
        yield (
            f"the robot's {letter} has the other sign: its positions are left-handed, its rotations are not; turn "
            f"{letter} round",
            [replace(reading, poses=poses) for reading, poses in zip(usual, turned, strict=True)],
        )
