"""The edges of an AprilTag: its cells, and the pose that fits every step from black to white.

A sample of an edge is a point of the tag between a black and a white cell. Around it the picture rises from
black to white along the edge's normal; the mean grey level of a window centred there says how far the step is
from the centre, whatever the blur, as long as it is symmetric. Poses are fitted to these offsets by
Gauss-Newton with Tukey's weights (Holland and Welsch 1977).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import HecbenchError, InputError
from hecbench.recording import CameraModel
from hecbench.se3 import Array
from hecbench.targets import AprilTagTarget

FAMILIES = {"tag36h11": 8, "tag25h9": 7, "tag16h5": 6}
"""Cells along the side of the black square, by family."""

_ALONG = (0.2, 0.35, 0.5, 0.65, 0.8)
"""Where on the side of a cell the samples lie."""
_ROUNDS = 5
_WINDOW_CELLS, _WINDOW_PX = 0.5, (1.0, 6.0)
_PROFILE = 25
_LEAST_EDGES = 40
_LEAST_CONTRAST = 15.0
_TUKEY = 4.685
_LEAST_SIGMA_PX = 0.02
_CORRELATED = len(_ALONG)
"""Samples of one side of a cell err together and count as one."""


class TagRefused(HecbenchError):
    """The picture gives no trustworthy pose of the tag; the message says why and what to do."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A pose that fits the edges: camera_T_tag (4, 4) m, its covariance (6, 6), and the rms offset."""

    camera_T_tag: Array
    covariance: Array
    error_px: float


def cells(family: str, tag_id: int) -> NDArray[np.bool_]:
    """(n, n), True where white, of the official tag seen upright, its black border included.

    OpenCV draws AprilTags turned by 180 degrees.

    Raises:
        InputError: unknown family or id.
    """
    import cv2

    if family not in FAMILIES:
        raise InputError(f"target.family: '{family}' is not one of {', '.join(FAMILIES)}")
    width = FAMILIES[family]
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_APRILTAG_{family[3:]}"))
    if not 0 <= tag_id < len(dictionary.bytesList):
        raise InputError(
            f"target.id: {tag_id} is not within 0 to {len(dictionary.bytesList) - 1} of {family}"
        )
    return np.rot90(cv2.aruco.generateImageMarker(dictionary, tag_id, width, borderBits=1) > 127, 2)


def project(camera: CameraModel, camera_T_tag: Array, points_m: Array) -> Array:
    """Pixels (P, 2) of points (P, 3) m of the tag, with the camera's distortion."""
    import cv2

    rotvec, shift = se3.so3_log(camera_T_tag[:3, :3]), camera_T_tag[:3, 3]
    pixels, _ = cv2.projectPoints(points_m, rotvec, shift, camera.K, camera.distortion)
    return np.asarray(pixels[:, 0])


@cache
def _samples(target: AprilTagTarget) -> tuple[Array, Array, Array, Array]:
    """Points on the edges (E, 3) m and the directions (E, 3) from black to white, in the tag's frame, and the
    centres of the black (B, 3) and of the white cells (W, 3).
    """
    white = np.pad(cells(target.family, target.id), 1, constant_values=True)
    count = len(white)
    cell_m = target.size_m / (count - 2)
    points, normals = [], []
    for axis in (0, 1):
        rise = np.diff(white.astype(int), axis=axis)
        for row, column in np.argwhere(rise):
            for share in _ALONG:
                along = np.array([column + share, row + 1.0] if axis == 0 else [column + 1.0, row + share])
                points.append(along)
                normal = np.array([0.0, 1.0] if axis == 0 else [1.0, 0.0])
                normals.append(rise[row, column] * normal)
    grid = np.argwhere(np.ones_like(white))[:, ::-1] + 0.5

    def metric(cells_xy: NDArray[np.floating]) -> Array:
        return np.column_stack([(cells_xy - count / 2) * cell_m, np.zeros(len(cells_xy))])

    directions = np.column_stack([np.array(normals), np.zeros(len(normals))])
    return metric(np.array(points)), directions, metric(grid[~white.ravel()]), metric(grid[white.ravel()])


def refined(
    grey: NDArray[np.uint8], camera: CameraModel, target: AprilTagTarget, camera_T_tag: Array
) -> Fit | None:
    """The pose near `camera_T_tag` (4, 4) m that fits the edges of the tag; None where they do not fit."""
    points, normals, black, white = _samples(target)
    dark, bright = (
        float(np.median(_sampled(grey, project(camera, camera_T_tag, centres)))) for centres in (black, white)
    )
    if bright - dark < _LEAST_CONTRAST:
        return None
    cell_m = target.size_m / FAMILIES[target.family]
    for _ in range(_ROUNDS):
        here = project(camera, camera_T_tag, points)
        ahead = project(camera, camera_T_tag, points + 0.1 * cell_m * normals)
        across = (ahead - here) / np.linalg.norm(ahead - here, axis=1)[:, None]
        cell_px = 10 * np.linalg.norm(ahead - here, axis=1)
        reach = np.clip(_WINDOW_CELLS * cell_px, *_WINDOW_PX)
        offsets = _offsets(grey, here, across, reach, dark, bright)
        usable = np.abs(offsets) < 0.8 * reach
        if usable.sum() < _LEAST_EDGES * _CORRELATED:
            return None
        jacobian = _jacobian(camera, camera_T_tag, points, across)
        spread = max(1.4826 * float(np.median(np.abs(offsets[usable]))), _LEAST_SIGMA_PX)
        scaled = np.minimum(np.abs(offsets) / (_TUKEY * spread), 1.0)
        weights = usable * (1 - scaled**2) ** 2
        information = jacobian.T @ (weights[:, None] * jacobian)
        camera_T_tag = se3.exp(np.linalg.solve(information, jacobian.T @ (weights * offsets))) @ camera_T_tag
    variance = float((weights * offsets**2).sum() / max(weights.sum() - 6, 1))
    covariance = _CORRELATED * max(variance, _LEAST_SIGMA_PX**2) * np.linalg.inv(information)
    return Fit(camera_T_tag, covariance, float(np.sqrt(np.mean(offsets[usable] ** 2))))


def _offsets(
    grey: NDArray[np.uint8], centres: Array, across: Array, reach: Array, dark: float, bright: float
) -> Array:
    """How far (E,) px the step from dark to bright lies from each centre (E, 2), along directions (E, 2)."""
    steps = (np.arange(_PROFILE) + 0.5) / _PROFILE * 2 - 1
    places = centres[:, None] + steps[:, None] * (reach[:, None, None] * across[:, None])
    share = (_sampled(grey, places).mean(1) - dark) / (bright - dark)
    return np.asarray(reach * (1 - 2 * share))


def _sampled(grey: NDArray[np.uint8], pixels: Array) -> Array:
    """Grey levels (...) at pixels (..., 2), interpolated."""
    import cv2

    flat = pixels.reshape(-1, 1, 2).astype(np.float32)
    pieces = [
        cv2.remap(grey, piece, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        for piece in np.array_split(flat, len(flat) // 30000 + 1)
    ]
    return np.concatenate(pieces).astype(float).reshape(pixels.shape[:-1])


def _jacobian(camera: CameraModel, camera_T_tag: Array, points: Array, across: Array) -> Array:
    """(E, 6): how far each point moves along its direction (E, 2) per unit of a twist from the left."""
    step = 1e-6
    columns = []
    for axis in np.eye(6):
        ahead = project(camera, se3.exp(step * axis) @ camera_T_tag, points)
        behind = project(camera, se3.exp(-step * axis) @ camera_T_tag, points)
        columns.append(((ahead - behind) * across).sum(1) / (2 * step))
    return np.array(columns).T
