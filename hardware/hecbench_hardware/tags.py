"""The pose of an object from its AprilTag: detection, both planar solutions, refinement, covariance, refusals.

Detection: hecbench.system.apriltags. Planar pose: Collins and Bartoli 2014,
"Infinitesimal plane-based pose estimation", both solutions, each refined on every edge between a black and a
white cell of the tag (tag_edges.py): some hundred edge points instead of four corners.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import CameraModel
from hecbench.se3 import Array
from hecbench.system import apriltags
from hecbench.targets import AprilTagTarget
from hecbench_hardware import tag_edges
from hecbench_hardware.tag_edges import FAMILIES, TagRefused

Grey = NDArray[np.uint8]

_MARGIN_CELLS = 0.7
_LARGE_PX = 1000
"""Larger pictures are first searched at half their size; the edges are measured at full size in any case."""
_MOST_BLUR_CELLS = 0.6
_MOST_BLUR_PX = 3.0
_SAME_RAD = 1e-3
_AMBIGUOUS = 1.5
"""Ratio of the errors below which the second solution might be the right one."""


@dataclass(frozen=True, eq=False)
class TagPose:
    """Where a tag is.

    Attributes:
        camera_T_tag: (4, 4) m; tag frame x right, y down, z into the tag.
        covariance: (6, 6) of [phi rad, rho m] in ``T_true = exp([phi, rho]) @ camera_T_tag``.
        error_px: rms distance of the tag's edges in the picture from where this pose puts them.
        corners_px: (4, 2) bottom-left, bottom-right, top-right, top-left; pixel centres at integers.
        other: the second planar solution and its error_px, None when there is none before the camera.
        ambiguous: whether the second solution explains the picture nearly as well.
    """

    camera_T_tag: Array
    covariance: Array
    error_px: float
    corners_px: Array
    other: tuple[Array, float] | None
    ambiguous: bool


def locate(image: NDArray[np.uint8], camera: CameraModel, target: AprilTagTarget) -> TagPose:
    """The pose of one tag in a picture (H, W, 3) RGB or (H, W) grey.

    Raises:
        TagRefused: not in the picture, twice, clipped, blurred, or of another family.
        InputError: the camera has no intrinsics, or another size than the picture.
    """
    if camera.K is None:
        raise InputError("the camera's intrinsics are unknown: give K")
    if image.shape[:2] != (camera.height, camera.width):
        raise InputError(
            f"the picture is {image.shape[1]}x{image.shape[0]} px, the camera {camera.width}x{camera.height}:"
            " give the camera that took it"
        )
    if image.dtype != np.uint8 or image.shape[2:] not in ((), (3,)):
        raise InputError(
            f"a picture of {image.shape} {image.dtype}: give (H, W, 3) RGB or (H, W) grey, 8 bits"
        )
    grey = _grey(image)
    corners_px = _the_tag(grey, target)
    cell_px = float(np.linalg.norm(np.diff(corners_px, axis=0), axis=1).min()) / FAMILIES[target.family]
    _refuse_clipped(corners_px, cell_px, camera)
    _refuse_blurred(grey, corners_px, cell_px)
    found = []
    for rough in planar_solutions(corners_px, camera, target):
        refined = tag_edges.refined(grey, camera, target, rough)
        if refined is not None:
            found.append(refined)
    if not found:
        raise TagRefused(
            "the tag's edges do not fit any pose: check the intrinsics and the tag's id and size"
        )
    found.sort(key=lambda fit: fit.error_px)
    best, second = found[0], found[1] if len(found) > 1 else None
    same = second is not None and _angle(best.camera_T_tag, second.camera_T_tag) < _SAME_RAD
    if second is None or same:
        return TagPose(best.camera_T_tag, best.covariance, best.error_px, corners_px, None, False)
    ambiguous = second.error_px < _AMBIGUOUS * best.error_px
    other = second.camera_T_tag, second.error_px
    return TagPose(best.camera_T_tag, best.covariance, best.error_px, corners_px, other, ambiguous)


def planar_solutions(corners_px: Array, camera: CameraModel, target: AprilTagTarget) -> list[Array]:
    """Up to two camera_T_tag (4, 4) m before the camera that put the corners (4, 2) px near where they are."""
    import cv2

    intrinsics = camera.K, camera.distortion
    points = target.points_m
    _, rotvecs, shifts, _ = cv2.solvePnPGeneric(points, corners_px, *intrinsics, flags=cv2.SOLVEPNP_IPPE)
    found = []
    for first in zip(rotvecs, shifts, strict=True):
        rotvec, shift = cv2.solvePnPRefineLM(points, corners_px, *intrinsics, *first)
        camera_T_tag = se3.from_rotvec(rotvec[:, 0], shift[:, 0])
        if np.isfinite(camera_T_tag).all() and camera_T_tag[2, 3] > 0:
            found.append(camera_T_tag)
    return found


def _angle(first: Array, second: Array) -> float:
    return float(se3.rotation_error_rad(first, second))


def _grey(image: NDArray[np.uint8]) -> Grey:
    import cv2

    return np.ascontiguousarray(image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))


def _the_tag(grey: Grey, target: AprilTagTarget) -> Array:
    """The corners of the one tag of the target's family and id."""
    if target.family not in FAMILIES:
        raise InputError(f"target.family: '{target.family}' is not one of {', '.join(FAMILIES)}")
    found: list[apriltags.Tag] = []
    same: list[Array] = []
    for decimate in (2.0, 1.0) if max(grey.shape) > _LARGE_PX else (1.0,):
        found = apriltags.detected(grey, target.family, decimate)
        if same := [tag.corners_px for tag in found if tag.id == target.id]:
            break
    if len(same) > 1:
        raise TagRefused(f"{len(same)} tags have id {target.id} of {target.family}: cover all but one")
    if same:
        return same[0]
    seen = {f"{target.family} id {tag.id}" for tag in found}
    for family in FAMILIES:
        if family != target.family:
            seen |= {f"{family} id {tag.id}" for tag in apriltags.detected(grey, family)}
    wanted = f"{target.family} id {target.id}"
    if seen:
        raise TagRefused(f"{wanted} is not in the picture, but {', '.join(sorted(seen))}: name the right tag")
    raise TagRefused(f"{wanted} is not in the picture: uncover it, turn it to the camera, light it evenly")


def _refuse_clipped(corners_px: Array, cell_px: float, camera: CameraModel) -> None:
    """Refuse when the white margin around the tag is not in the picture."""
    margin = _MARGIN_CELLS * cell_px
    limit = np.array([camera.width, camera.height]) - 1 - margin
    if (corners_px < margin).any() or (corners_px > limit).any():
        raise TagRefused("the tag touches the edge of the picture: move it or the camera")


def _refuse_blurred(grey: Grey, corners_px: Array, cell_px: float) -> None:
    """Refuse when the outer edges are as wide as a cell."""
    width_px = edge_width_px(grey, corners_px)
    if width_px > max(_MOST_BLUR_PX, _MOST_BLUR_CELLS * cell_px):
        raise TagRefused(
            f"the tag is blurred, its edges are {width_px:.1f} px wide: focus, expose shorter, stand still"
        )


def edge_width_px(grey: Grey, corners_px: Array) -> float:
    """How wide the step from black to white is on the outer edges: contrast over steepest slope, median."""
    import cv2

    sides = []
    reach = np.arange(-8.0, 8.01, 0.5)
    along = np.linspace(0.2, 0.8, 13)[:, None]
    for start, end in zip(corners_px, np.roll(corners_px, -1, axis=0), strict=True):
        direction = (end - start) / np.linalg.norm(end - start)
        normal = np.array([-direction[1], direction[0]])
        points = (start + along * (end - start))[:, None] + reach[:, None] * normal
        u, v = (points[..., i].astype(np.float32) for i in (0, 1))
        profile = cv2.remap(grey, u, v, cv2.INTER_LINEAR).astype(float).mean(0)
        slope = np.abs(np.diff(profile)).max() / 0.5
        sides.append(np.ptp(profile) / max(slope, 1e-9))
    return float(np.median(sides))
