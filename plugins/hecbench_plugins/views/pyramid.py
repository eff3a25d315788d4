"""What a renderer method compares: per view and level of a pyramid, a renderer and the observed picture."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError, Refusal, SolverFailure
from hecbench.recording import Recording
from hecbench.rendering import Renderer, RenderMesh
from hecbench.rendering.undistort import Undistortion, shrunk_intrinsics
from hecbench.robots.model import RobotModel
from hecbench.robots.posed import PosedRobot
from hecbench.se3 import Array
from hecbench_plugins.views.settings import PYRAMID

Picture = NDArray[np.float32]

_COARSE_CELL_M = {16: 0.02, 8: 0.01, 4: 0.004, 2: 0.0015, 1: 0.0}


class NoMask(Refusal):
    """An image without a mask whose background is too lively to tell the robot by it."""


class RaggedMasks(SolverFailure):
    """Masks whose contour is nowhere that of the robot to the pixel, and an end that they leave in doubt."""

    def __init__(self, message: str, parent_T_camera: Array) -> None:
        super().__init__(message)
        self.parent_T_camera = parent_T_camera


@lru_cache(maxsize=4)
def meshes_by_level(model: RobotModel) -> dict[int, RenderMesh]:
    """The model's meshes by level; merged cells move no contour by more than a tenth of a level's pixel."""
    return {level: RenderMesh.cached(model, cell_m=cell_m) for level, cell_m in _COARSE_CELL_M.items()}


def mesh_at(meshes: dict[int, RenderMesh], level: int) -> RenderMesh:
    """The mesh for pictures of a level, the coarsest there is for still smaller ones."""
    return meshes[min(level, max(meshes))]


@dataclass(frozen=True, eq=False)
class Level:
    """One view at one size."""

    renderer: Renderer
    observed: Picture
    """(h, w, 4): RGB, 0 outside the mask when `masked`, and the mask, all in [0, 1]."""
    background: NDArray[np.float32]
    """(4,), the last 0."""
    hidden: NDArray[np.bool_] | None
    """(h, w) where something else may stand before the robot, observed as background; None: nowhere."""

    def unseen(self, pixels: NDArray[np.int32]) -> NDArray[np.bool_]:
        """Which crossings (C,), of flat pixels (C, 2), touch what is hidden."""
        if self.hidden is None:
            return np.zeros(len(pixels), bool)
        return np.asarray(self.hidden.reshape(-1)[pixels].any(1))

    def drawn(self) -> NDArray[np.bool_]:
        """Where (h, w) the robot was drawn last and can be seen."""
        drawn = self.renderer.face >= 0
        return drawn if self.hidden is None else drawn & ~self.hidden


@dataclass(frozen=True, eq=False)
class View:
    """One sample: where the links are in the parent frame, and its pyramid."""

    joints_rad: Array
    parent_T_link: Array
    levels: dict[int, Level]
    raw: Picture
    """(H, W, 3) undistorted, not cut by the mask."""
    has_image: bool
    has_mask: bool
    """Given, not found before a uniform background."""
    uniform_background: bool


def photographed_robot(recording: Recording) -> PosedRobot:
    """The robot that the photographs of a recording show.

    Raises:
        Refusal: no intrinsics or joints, or pictures of a few rows or columns.
        InputError: there is no robot model, or its description is faulty.
    """
    if recording.camera is None or recording.camera.K is None:
        raise Refusal("the camera's intrinsics are unknown")
    if recording.joints_rad is None:
        raise Refusal("no sample has joints_rad")
    width, height = recording.camera.width, recording.camera.height
    if min(width, height) < PYRAMID.least_px:
        raise Refusal(
            f"pictures of {width}x{height} px are too small to find the robot in: {PYRAMID.least_px} px or more each "
            "way"
        )
    return PosedRobot.of(recording)


def prepare(recording: Recording) -> tuple[PosedRobot, list[View]]:
    """The moving robot and the views of a recording.

    Raises:
        Refusal: no intrinsics, robot, joints or pictures, or a mask without (or with nothing but) robot.
        NoMask: an image without a mask and without a uniform background.
    """
    try:
        robot = photographed_robot(recording)
        meshes = meshes_by_level(robot.model)
        rows = robot.samples
        poses = robot.link_poses(robot.joints_rad[rows])
        pinhole = Undistortion.of(recording.present.camera)
        views = [
            _view(recording, int(row), parent_T_link, meshes, pinhole)
            for row, parent_T_link in zip(rows, poses, strict=True)
        ]
    except InputError as error:
        raise Refusal(str(error)) from error
    found = [view for view in views if view is not None]
    if not found:
        raise Refusal("no sample with joints has an image or a mask")
    return robot, found


def _view(
    recording: Recording, row: int, parent_T_link: Array, meshes: dict[int, RenderMesh], pinhole: Undistortion
) -> View | None:
    joints_rad = recording.present.joints_rad[row]
    has_image = recording.images is not None and recording.images[row] is not None
    has_mask = recording.masks is not None and recording.masks[row] is not None
    if not has_image and not has_mask:
        return None
    where = f"samples[{row}]"
    raw: Picture | None = None
    uniform, background = False, np.zeros(3, np.float32)
    if has_image:
        raw = pinhole.image(np.asarray(recording.image(row)))
        if not np.isfinite(raw).all():
            raise Refusal(f"{where}: the image holds values that are not finite")
    if has_mask:
        mask = pinhole.image(recording.mask(row).astype(np.uint8) * np.uint8(255))
    else:
        assert raw is not None
        mask = foreground(raw, where)
    filled = float((mask > 0.5).mean())
    if not PYRAMID.least_mask < filled < PYRAMID.most_mask:
        raise Refusal(
            f"{where}: the mask covers {100 * filled:.1f} % of the image: no contour of a robot to align"
        )
    if raw is not None:
        outside = raw[_far_from(mask)]
        if len(outside):
            background = np.median(outside, 0)
            uniform = bool(np.abs(outside - background).mean() < PYRAMID.background_spread)
    cut = np.zeros((*mask.shape, 4), np.float32)
    cut[..., 3] = mask
    if raw is not None:
        cut[..., :3] = raw if uniform else raw * mask[..., None]
    hidden = None
    if raw is not None and uniform and has_mask:
        hidden = hidden_by_others(raw, background, mask)
        if hidden is not None:
            cut[hidden] = np.append(background, 0)
    reference = np.append(background if uniform else np.zeros(3), 0).astype(np.float32)
    levels = {
        level: Level(
            Renderer(
                meshes[level],
                shrunk_intrinsics(pinhole.K, 1 / level),
                mask.shape[1] // level,
                mask.shape[0] // level,
            ),
            shrink(cut, level),
            reference,
            None if hidden is None else shrink(hidden[..., None].astype(np.float32), level)[..., 0] > 0,
        )
        for level in PYRAMID.levels
    }
    full = raw if raw is not None else np.zeros((*mask.shape, 3), np.float32)
    return View(joints_rad, parent_T_link, levels, full, has_image, has_mask, uniform)


def linearised(view: View, gamma: float) -> View:
    """The view with its colours raised to 1 / gamma, so that neighbouring colours mix linearly at edges again."""
    levels = {}
    for size, level in view.levels.items():
        observed, background = level.observed.copy(), level.background.copy()
        observed[..., :3] = np.maximum(observed[..., :3], 0) ** (1 / gamma)
        background[:3] = np.maximum(background[:3], 0) ** (1 / gamma)
        levels[size] = replace(level, observed=observed, background=background)
    return replace(view, levels=levels)


def shrink(picture: Picture, level: int) -> Picture:
    """Means over squares of `level` pixels of a picture (H, W, C); a rest at the border is left out."""
    if level == 1:
        return np.ascontiguousarray(picture)
    import cv2

    height, width = picture.shape[0] // level, picture.shape[1] // level
    whole = picture[: height * level, : width * level]
    small = cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA)
    return np.asarray(small.reshape(height, width, picture.shape[2]), np.float32)


def foreground(image: Picture, where: str) -> Picture:
    """A mask (H, W) in {0, 1} of what differs from a uniform background, found on a smoothed image.

    Raises:
        NoMask: the border of the image is not uniform, so that only a given mask could tell the robot.
    """
    import cv2

    border = np.concatenate(
        [image[:8].reshape(-1, 3), image[-8:].reshape(-1, 3), image[:, :8].reshape(-1, 3)]
    )
    background = np.median(border, 0)
    smooth = cv2.blur(image, (5, 5), borderType=cv2.BORDER_REFLECT)
    off = np.abs(smooth - background).max(-1)
    rim = np.concatenate([off[:8].ravel(), off[-8:].ravel()])
    if np.percentile(rim, 90) > PYRAMID.background_spread:
        raise NoMask(f"{where}: no mask, and the background is not uniform: give masks of the robot")
    from scipy import ndimage

    threshold = max(0.02, 3 * float(np.median(off) + np.std(rim)))
    mask = ndimage.binary_opening(ndimage.binary_fill_holes(off > threshold), iterations=2)
    return np.asarray(mask, np.float32)


def hidden_by_others(
    image: Picture, background: NDArray[np.float32], mask: Picture
) -> NDArray[np.bool_] | None:
    """Where (H, W) something neither robot, by the mask, nor background, by the picture, may hide the robot.

    Such places say nothing about the robot. What is thinner than `smallest_hiding_px` is a ragged edge of the mask.
    Where more is other than is robot, the picture shows a furnished scene, and the mask alone says what hides.
    """
    import cv2

    red, green, blue = (np.abs(cv2.blur(image, (5, 5)) - background) > PYRAMID.background_spread).transpose(
        2, 0, 1
    )
    off = red | green | blue
    other = (off & (mask < 0.5)).astype(np.uint8)
    thick = cv2.morphologyEx(other, cv2.MORPH_OPEN, np.ones((PYRAMID.smallest_hiding_px,) * 2, np.uint8))
    if not thick.any() or thick.mean() > (mask > 0.5).mean():
        return None
    return np.asarray(cv2.dilate(thick, np.ones((2 * PYRAMID.soft_edge_px + 1,) * 2, np.uint8)) > 0)


def _far_from(mask: Picture) -> NDArray[np.bool_]:
    import cv2

    near = cv2.dilate(shrink(mask[..., None], 4)[..., 0], np.ones((9, 9), np.uint8)) > 0
    far = np.zeros(mask.shape, bool)
    grown = np.repeat(np.repeat(near, 4, 0), 4, 1)
    far[: grown.shape[0], : grown.shape[1]] = ~grown
    return far


def signed_distance(mask: Picture, hidden: NDArray[np.bool_] | None = None) -> NDArray[np.float32]:
    """Distance (h, w) px of pixel centres from the contour of `mask` > 0.5, negative inside.

    Where the mask ends at something hidden it has no contour.
    """
    import cv2

    inside = (mask > 0.5).astype(np.uint8)
    outward = cv2.distanceTransform(1 - inside, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    solid = inside if hidden is None else inside | hidden.astype(np.uint8)
    inward = cv2.distanceTransform(solid, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.asarray(np.where(inside > 0, 0.5 - inward, outward - 0.5), np.float32)
