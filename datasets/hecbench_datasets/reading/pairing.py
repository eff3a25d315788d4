"""Two pose streams of one format, read under a proven convention, as a recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from hecbench.errors import InputError
from hecbench.exchange.conventions import prove
from hecbench.exchange.pose_numbers import PoseConvention, pose_conventions
from hecbench.recording import Mounting, Recording
from hecbench_datasets.reading.hints import Hints


@dataclass(frozen=True, kw_only=True)
class Documented:
    """What a format's description says; None where it says nothing."""

    mounting: Mounting | None = None
    robot_inverted: bool = False
    robot_rotation: str | Sequence[str] | None = None
    robot_unit: str | None = None
    target_inverted: bool = False
    target_rotation: str | Sequence[str] | None = None
    target_unit: str | None = None


def paired(
    path: Path,
    robot_poses: ArrayLike,
    target_poses: ArrayLike,
    documented: Documented,
    hints: Hints,
    *,
    ids: Sequence[str] | None = None,
    **fields: Any,
) -> Recording:
    """The recording of robot and target poses (N, 6 | 7 | 12 | 16) under the convention that is proven or given.

    Args:
        path: names the source and the recording.
        robot_poses: base_T_flange, or its inverse, as documented.
        target_poses: camera_T_target, or its inverse, as documented.
        documented: the format's convention.
        hints: the user's, which go before it.
        ids: of the samples; numbers by default.
        **fields: further fields of the recording.

    Raises:
        InputError: the numbers are no poses, or no reading can be distinguished from the others.
    """
    robot_readings = _stream(
        f"{path}: robot pose",
        robot_poses,
        ("base", "flange"),
        rotation=hints.robot_rotation,
        assumed_rotation=documented.robot_rotation,
        unit=hints.robot_unit or documented.robot_unit,
        inverted=_is_inverse(hints.robot_pose, "flange_T_base"),
        assumed_inverted=documented.robot_inverted,
    )
    target_readings = _stream(
        f"{path}: target pose",
        target_poses,
        ("camera", "target"),
        rotation=hints.target_rotation,
        assumed_rotation=documented.target_rotation,
        unit=hints.target_unit or documented.target_unit,
        inverted=_is_inverse(hints.target_pose, "target_T_camera"),
        assumed_inverted=documented.target_inverted,
    )
    mounting = hints.mounting or documented.mounting
    mounting_given = hints.mounting is not None
    proof = prove(
        str(path), robot_readings, target_readings, [mounting] if mounting else list(Mounting), mounting_given
    )
    count = len(proof.base_T_flange)
    return Recording(
        name=path.stem or path.name,
        mounting=proof.mounting,
        sample_ids=tuple(ids) if ids is not None else tuple(f"{i:06d}" for i in range(count)),
        base_T_flange=proof.base_T_flange,
        camera_T_target=proof.camera_T_target,
        notes=(proof.note,),
        folder=path if path.is_dir() else path.parent,
        **fields,
    )


def _stream(source: str, numbers: ArrayLike, frames: tuple[str, str], **options: Any) -> list[PoseConvention]:
    try:
        return pose_conventions(numbers, frames, **options)
    except InputError as error:
        raise InputError(f"{source}: {error}") from error


def _is_inverse(spelling: str | None, inverse: str) -> bool | None:
    return None if spelling is None else spelling == inverse
