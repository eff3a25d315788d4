"""What was measured: robot poses, observations of a target or of the robot, and how they were mounted."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import InputError, Refusal
from hecbench.lens import OPENCV, finite
from hecbench.lens import CameraModel as CameraModel
from hecbench.se3 import Array
from hecbench.system import pictures
from hecbench.targets import Target

Image = NDArray[np.uint8]
_Value = TypeVar("_Value", np.uint8, np.bool_, np.float32)
ImageSource = Path | Image | NDArray[np.uint16] | None
"""A file that is decoded when asked for, an array in memory, or nothing for this sample."""

_ROTATION_TOLERANCE = 1e-3


class Need(StrEnum):
    """What a recording can offer, and what a solver asks of it."""

    TARGET_POSES = "target_poses"
    CORNERS = "corners"
    INTRINSICS = "intrinsics"
    IMAGES = "images"
    MASKS = "masks"
    DEPTH = "depth"
    JOINTS = "joints"
    ROBOT_MODEL = "robot_model"
    INITIAL = "initial"


class Mounting(StrEnum):
    """Where the camera sits: fixed beside the robot, or on its flange."""

    EYE_TO_HAND = "eye_to_hand"
    EYE_IN_HAND = "eye_in_hand"


@dataclass(frozen=True, kw_only=True)
class RobotDescription:
    """The arm by name or URDF file, and the two links between which `base_T_flange` is given."""

    model: str | None = None
    urdf: Path | None = None
    base_link: str = "base"
    flange_link: str = "tool0"
    joint_names: tuple[str, ...] = ()

    @property
    def source(self) -> str | Path | None:
        """What `load_robot` takes: the URDF where there is one, or the name; None when neither is known."""
        return self.urdf or self.model


@dataclass(frozen=True, eq=False, kw_only=True)
class Recording:
    """N samples as a struct of arrays; a NaN row says that the sample lacks this quantity.

    Attributes:
        name: of the recording.
        mounting: where the camera sits; decides what "parent" means (`parent_link`).
        sample_ids: N names.
        robot: None for pose-only recordings.
        camera: None when only `camera_T_target` is used.
        target: None for markerless recordings.
        initial_parent_T_camera: (4, 4) start, or None.
        truth_parent_T_camera: (4, 4), or None; solvers get a copy without it.
        base_T_flange: (N, 4, 4) m.
        joints_rad: (N, J).
        camera_T_target: (N, 4, 4) m.
        corners_px: (N, P, 2), one row per target point.
        robot_stamp_s, camera_stamp_s: (N,).
        images: N sources of (height, width, 3) RGB.
        masks: N sources of (height, width), above 127 = robot, or 0 and 1.
        depths: N sources of (height, width) 16-bit depth along the optical axis, mm, 0 where unknown.
        folder: where it was read from, None when generated.
        notes: what its importer found out about its conventions, to be said to the user; not saved.
    """

    name: str
    mounting: Mounting
    sample_ids: tuple[str, ...]
    robot: RobotDescription | None = None
    camera: CameraModel | None = None
    target: Target | None = None
    initial_parent_T_camera: Array | None = None
    truth_parent_T_camera: Array | None = None
    base_T_flange: Array | None = None
    joints_rad: Array | None = None
    camera_T_target: Array | None = None
    corners_px: Array | None = None
    robot_stamp_s: Array | None = None
    camera_stamp_s: Array | None = None
    images: tuple[ImageSource, ...] | None = None
    masks: tuple[ImageSource, ...] | None = None
    depths: tuple[ImageSource, ...] | None = None
    folder: Path | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.sample_ids:
            raise InputError("samples: there are none; a recording needs at least one")
        if len(set(self.sample_ids)) != len(self.sample_ids):
            raise InputError("samples: two have the same id; make the ids unique")
        for name in ("initial_parent_T_camera", "truth_parent_T_camera"):
            if (pose := getattr(self, name)) is not None:
                self._put(name, _rigid(finite(name, pose, (4, 4))[None], name)[0])
        for name in ("base_T_flange", "camera_T_target"):
            if (poses := self._per_sample(name, (4, 4))) is not None:
                self._put(name, _rigid(poses, f"samples[{{}}].{name}"))
        joint_count = np.shape(self.joints_rad)[-1] if self.joints_rad is not None else 0
        self._put("joints_rad", self._per_sample("joints_rad", (joint_count,)))
        if self.robot and self.robot.joint_names and self.joints_rad is not None:
            declared = len(self.robot.joint_names)
            if joint_count != declared:
                raise InputError(
                    f"samples[0].joints_rad: {joint_count} numbers for {declared} robot.joint_names"
                )
        for name in ("robot_stamp_s", "camera_stamp_s"):
            self._put(name, self._per_sample(name, ()))
        self._check_corners()
        for name in _PER_SAMPLE_PICTURES:
            if (sources := getattr(self, name)) is not None and len(sources) != len(self):
                raise InputError(f"{name}: {len(sources)} for {len(self)} samples")
        self._check_every_sample_has_a_robot_pose()

    def _per_sample(self, name: str, shape: tuple[int, ...]) -> Array | None:
        """The array of that name with N rows; rows are finite or wholly NaN, all-NaN arrays None."""
        if (value := getattr(self, name)) is None:
            return None
        array = np.asarray(value, float)
        if array.shape != (len(self), *shape):
            raise InputError(
                f"{name}: shape {array.shape}, expected {(len(self), *shape)}, one row per sample"
            )
        finite = np.isfinite(array.reshape(len(self), -1))
        for i in np.flatnonzero(finite.any(1) & ~finite.all(1)):
            raise InputError(
                f"samples[{i}].{name}: holds a number that is not finite; correct or leave it out"
            )
        return array if finite.any() else None

    def _put(self, name: str, value: Array | None) -> None:
        object.__setattr__(self, name, value)

    def _check_corners(self) -> None:
        if self.corners_px is None:
            return
        if self.target is None:
            raise InputError("samples[0].corners_px: given without a target; describe the target")
        corners = np.asarray(self.corners_px, float)
        expected = (len(self), len(self.target.points_m), 2)
        if corners.shape != expected:
            raise InputError(
                f"corners_px: shape {corners.shape}, expected {expected}: one row per target point"
            )
        if np.isinf(corners).any() or (np.isnan(corners[..., 0]) != np.isnan(corners[..., 1])).any():
            raise InputError("corners_px: holds a number that is not finite; use null for a point not seen")
        self._put("corners_px", corners if np.isfinite(corners).any() else None)

    def _check_every_sample_has_a_robot_pose(self) -> None:
        known = np.zeros(len(self), bool)
        for array in (self.base_T_flange, self.joints_rad):
            if array is not None:
                known |= np.isfinite(array.reshape(len(self), -1)).all(1)
        for i in np.flatnonzero(~known):
            raise InputError(f"samples[{i}]: has neither base_T_flange nor joints_rad; give at least one")

    def __len__(self) -> int:
        return len(self.sample_ids)

    @property
    def parent_link(self) -> str:
        """The link the answer is given in: the base (eye_to_hand) or the flange (eye_in_hand)."""
        if self.mounting is Mounting.EYE_TO_HAND:
            return self.robot.base_link if self.robot else "base"
        return self.robot.flange_link if self.robot else "flange"

    def hand_poses(self) -> Array:
        """H (N, 4, 4) m, NaN rows where absent, that folds both mountings into one model.

        H is base_T_flange (eye_to_hand) or flange_T_base (eye_in_hand), so that with the answer
        X = parent_T_camera and the constant Y = carrier_T_target: ``camera_T_target = inverse(X) @ H @ Y``.

        Raises:
            Refusal: no sample has base_T_flange.
        """
        if self.base_T_flange is None:
            raise Refusal("no sample has base_T_flange, and the robot model that would give it is unknown")
        return hand_poses(self.mounting, self.base_T_flange)

    @property
    def present(self) -> Present:
        """Its fields as values that are never None: ``recording.present.camera``."""
        return Present(self)

    def offers(self) -> frozenset[Need]:
        """What this recording has of the things that solvers ask for."""
        has_intrinsics = self.camera is not None and self.camera.K is not None
        has_corners = self.corners_px is not None
        has = {
            Need.CORNERS: has_corners,
            Need.INTRINSICS: has_intrinsics,
            Need.TARGET_POSES: self.camera_T_target is not None or (has_corners and has_intrinsics),
            Need.IMAGES: self.images is not None and any(image is not None for image in self.images),
            Need.MASKS: self.masks is not None and any(mask is not None for mask in self.masks),
            Need.DEPTH: self.depths is not None and any(depth is not None for depth in self.depths),
            Need.JOINTS: self.joints_rad is not None,
            Need.ROBOT_MODEL: self.robot is not None and self.robot.source is not None,
            Need.INITIAL: self.initial_parent_T_camera is not None,
        }
        return frozenset(need for need, present in has.items() if present)

    def subset(self, indices: Sequence[int] | NDArray[np.integer]) -> Recording:
        """The same recording with only these samples, in this order."""
        order = np.asarray(indices, int)
        changes: dict[str, Any] = {"sample_ids": tuple(self.sample_ids[i] for i in order.tolist())}
        for name in _PER_SAMPLE_ARRAYS:
            if (array := getattr(self, name)) is not None:
                changes[name] = array[order]
        for name in _PER_SAMPLE_PICTURES:
            if (sources := getattr(self, name)) is not None:
                changes[name] = tuple(sources[i] for i in order.tolist())
        return replace(self, **changes)

    def without_truth(self) -> Recording:
        """The copy that solvers get."""
        return replace(self, truth_parent_T_camera=None)

    def image(self, index: int) -> Image:
        """Decode one image, (height, width, 3) RGB, as `pictures.image` reads it.

        Raises:
            InputError: it is absent, unreadable, or not of the camera's size.
        """
        return self._picture("images", index, pictures.image)

    def mask(self, index: int) -> NDArray[np.bool_]:
        """Decode one mask, (height, width), True on the robot, as `pictures.mask` reads it.

        Raises:
            InputError: it is absent, unreadable, or not of the camera's size.
        """
        return self._picture("masks", index, pictures.mask)

    def depth(self, index: int) -> NDArray[np.float32]:
        """Decode one depth picture, (height, width) m along the optical axis, 0 where unknown; see `pictures.depth`.

        Raises:
            InputError: it is absent, unreadable, not 16-bit, or not of the camera's size.
        """
        return self._picture("depths", index, pictures.depth)

    def _picture(
        self, name: str, index: int, decode: Callable[[Path | NDArray[Any], str], NDArray[_Value]]
    ) -> NDArray[_Value]:
        sources = getattr(self, name)
        source = sources[index] if sources else None
        where = f"samples[{index}].{name.removesuffix('s')}"
        if source is None:
            raise InputError(f"{self.name}: {where}: there is none")
        picture = decode(source, str(source) if isinstance(source, Path) else f"{self.name}: {where}")
        if self.camera and picture.shape[:2] != (self.camera.height, self.camera.width):
            height, width = picture.shape[:2]
            raise InputError(
                f"{self.name}: {where}: is {width}x{height} px, but the camera is "
                f"{self.camera.width}x{self.camera.height}; correct camera.width, height and K together"
            )
        return picture

    @cached_property
    def sha256(self) -> str:
        """Digest of the content: every array and description, and the bytes of the image files that exist."""
        digest = hashlib.sha256()
        for item in fields(self):
            value = getattr(self, item.name)
            if item.name not in ("folder", "notes") and value is not None:
                digest.update(item.name.encode())
                _update(digest, value)
        return digest.hexdigest()


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


_PER_SAMPLE_PICTURES = ("images", "masks", "depths")
_PER_SAMPLE_ARRAYS = (
    "base_T_flange",
    "joints_rad",
    "camera_T_target",
    "corners_px",
    "robot_stamp_s",
    "camera_stamp_s",
)


def hand_poses(mounting: Mounting, base_T_flange: Array) -> Array:
    """H (..., 4, 4) m of `Recording.hand_poses` for flange poses (..., 4, 4), and back."""
    return base_T_flange if mounting is Mounting.EYE_TO_HAND else se3.inverse(base_T_flange)


def _rigid(poses: Array, name: str) -> Array:
    """Check transforms (N, 4, 4), NaN rows allowed, and move rounded rotations onto SO(3).

    `name` is for errors; its {} stands for the sample's index.
    """
    given = ~np.isnan(poses).all((1, 2))
    for i in np.flatnonzero(given & ~se3.is_transform(poses, _ROTATION_TOLERANCE)):
        raise InputError(
            f"{name.format(i)}: is not a rigid transform; write a row-major 4x4 with an orthonormal, "
            "right-handed rotation, metres, and the last row 0 0 0 1"
        )
    rounded = given & ~se3.is_transform(poses, 1e-9)
    if rounded.any():
        poses = poses.copy()
        poses[rounded, :3, :3] = se3.nearest_rotation(poses[rounded, :3, :3])
    return poses


def _update(digest: Any, value: Any) -> None:
    if isinstance(value, np.ndarray):
        digest.update(str(value.shape).encode() + np.ascontiguousarray(value).tobytes())
    elif isinstance(value, Path):
        digest.update(value.read_bytes() if value.is_file() else value.name.encode())
    elif isinstance(value, tuple):
        for part in value:
            _update(digest, part)
    elif hasattr(value, "__dataclass_fields__"):
        for item in fields(value):
            part = getattr(value, item.name)
            if (
                item.name != "distortion_model" or part != OPENCV
            ):  # 0.1 had no such field: digests stay the same
                _update(digest, part)
    else:
        digest.update(repr(value).encode())
