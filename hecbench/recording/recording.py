"""What was measured: robot poses, observations of a target or of the robot, and how they were mounted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError, Refusal
from hecbench.lens import CameraModel
from hecbench.recording.checks import checked_arrays
from hecbench.recording.digest import digest_of
from hecbench.recording.present import Present
from hecbench.recording.terms import Image, ImageSource, Mounting, Need, RobotDescription, hand_poses
from hecbench.se3 import Array
from hecbench.system import pictures
from hecbench.targets import Target

_Value = TypeVar("_Value", np.uint8, np.bool_, np.float32)
_PER_SAMPLE_PICTURES = ("images", "masks", "depths")
_PER_SAMPLE_ARRAYS = (
    "base_T_flange",
    "joints_rad",
    "camera_T_target",
    "corners_px",
    "robot_stamp_s",
    "camera_stamp_s",
)


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
        for name, value in checked_arrays(self).items():
            object.__setattr__(self, name, value)
        for name in _PER_SAMPLE_PICTURES:
            if (sources := getattr(self, name)) is not None and len(sources) != len(self):
                raise InputError(f"{name}: {len(sources)} for {len(self)} samples")

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
        given = {
            item.name: getattr(self, item.name)
            for item in fields(self)
            if item.name not in ("folder", "notes")
        }
        return digest_of({name: value for name, value in given.items() if value is not None})
