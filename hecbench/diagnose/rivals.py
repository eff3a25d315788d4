"""Other readings of a recording's pictures, each fitted to the corners alone: lens, camera matrix, board, order."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.bundle.pictures import SharedFit, fit_shared
from hecbench.diagnose.resolution import BY_SIZE, rescaled
from hecbench.lens import EQUIDISTANT, OPENCV, CameraModel, Sensor, parameters_of, project
from hecbench.preparation import prepare
from hecbench.recording import Recording
from hecbench.se3 import Array
from hecbench.system.wording import significant
from hecbench.targets import grid_shape

LEAST_POINTS = 4
_LEAST_FREEDOM = 12
_FREEDOM_PER_UNKNOWN = 4
_LEAST_NOISE_PX = 0.02
"""Exact corners must not make rounding errors decide."""
_BAD_PICTURE = 4.0
"""Times the median residual: its corners are wrong, and it says nothing about the lens."""

_MATRIX_FREE: tuple[tuple[int | str, ...], ...] = (("focal",), (0, 1), (2, 3), ("focal", 2, 3), (0, 1, 2, 3))

LENS, MATRIX, RESOLUTION, BOARD, ORDER, GIVEN = "lens", "matrix", "resolution", "board", "order", "given"


@dataclass(frozen=True, eq=False)
class Rival:
    """One reading of the pictures.

    Attributes:
        cause: the part of the recording that it changes.
        says: the fault, as a clause.
        cure: what to do when it is right.
        recording: with the changed camera or corners.
        free: columns of [fx, fy, cx, cy, distortion..., log pitch] that are fitted; "focal" fits both by one factor.
        order: (P,) of the corners as they were listed.
    """

    cause: str
    says: str
    cure: str
    recording: Recording
    free: tuple[int | str, ...] = ()
    order: NDArray[np.int64] | None = None


@dataclass(frozen=True, eq=False)
class Judged:
    """A rival and how well it fits.

    Attributes:
        noise_px: rms distance that a corner keeps, after what poses and unknowns absorb.
        score: Bayesian information criterion (Schwarz 1978); smaller is better.
    """

    rival: Rival
    fit: SharedFit
    noise_px: float
    score: float


def judged(rivals: Iterable[Rival]) -> list[Judged]:
    """The rivals that can be fitted, best first."""
    rivals = list(rivals)
    recordings = {id(rival.recording): rival.recording for rival in rivals}
    posed = {key: prepare(replace(each, camera_T_target=None)) for key, each in recordings.items()}
    found = [_judged(rival, posed[id(rival.recording)]) for rival in rivals]
    return sorted((result for result in found if result is not None), key=lambda result: result.score)


def _judged(rival: Rival, recording: Recording) -> Judged | None:
    """The rival's unknowns fitted from its recording's target poses; None when too few numbers determine them."""
    poses, corners, target, camera = (
        recording.camera_T_target,
        recording.corners_px,
        recording.target,
        recording.camera,
    )
    if poses is None or corners is None or target is None or camera is None:
        return None
    posed = np.isfinite(poses).all((1, 2))
    poses, corners = poses[posed], corners[posed]
    observations = 2 * int(np.isfinite(corners).all(-1).sum())
    freedom = observations - 6 * len(poses)
    if not posed.all() or freedom < max(_LEAST_FREEDOM, _FREEDOM_PER_UNKNOWN * len(rival.free)):
        return None
    parameters = parameters_of(camera)
    basis = _basis(parameters, rival.free)
    fit = fit_shared(poses, target.points_m, corners, Sensor(camera.distortion_model), parameters, basis)
    if not np.isfinite(fit.squares_px2):
        return None
    variance = fit.squares_px2 / max(freedom - fit.free, 1)
    floor = max(fit.squares_px2 / freedom, _LEAST_NOISE_PX**2)
    score = freedom * float(np.log(floor)) + fit.free * float(np.log(freedom))
    return Judged(rival, fit, float(np.sqrt(2 * variance)), score)


def _basis(parameters: Array, free: tuple[int | str, ...]) -> Array:
    basis = np.zeros((len(parameters) + 1, len(free)))
    for column, which in enumerate(free):
        if isinstance(which, str):
            basis[:2, column] = parameters[:2]
        else:
            basis[which, column] = 1.0
    return basis


def comparable(recording: Recording, most: int) -> Recording | None:
    """At most so many pictures with enough points, evenly spread, without those whose corners are far off.

    None when too few are left.
    """
    corners = recording.corners_px
    if corners is None or recording.target is None or recording.camera is None or recording.camera.K is None:
        return None
    enough = np.flatnonzero(np.isfinite(corners).all(-1).sum(1) >= LEAST_POINTS)
    if not len(enough):
        return None
    chosen = enough[np.unique(np.linspace(0, len(enough) - 1, min(len(enough), most)).astype(int))]
    part = replace(recording.subset(chosen), images=None, masks=None)
    posed = prepare(replace(part, camera_T_target=None))
    if posed.camera_T_target is None:
        return None
    left = residuals_px(posed)
    return part.subset(np.flatnonzero(left <= _BAD_PICTURE * np.nanmedian(left)))


def residuals_px(recording: Recording) -> Array:
    """Rms distance (N,) px of each picture's corners from its own target pose, NaN where there is none."""
    present = recording.present
    poses, corners, target, camera = (
        present.camera_T_target,
        present.corners_px,
        present.target,
        present.camera,
    )
    squares = ((project(camera, se3.transform_points(poses, target.points_m)) - corners) ** 2).sum(-1)
    seen = np.isfinite(squares)
    return np.where(
        seen.any(1), np.sqrt(np.where(seen, squares, 0).sum(1) / np.maximum(seen.sum(1), 1)), np.nan
    )


def rivals(recording: Recording) -> Iterator[Rival]:
    """The recording as it is, then its rivals, those with fewer unknowns first."""
    camera = recording.present.camera
    yield Rival(GIVEN, "", "", recording)
    yield from _orders(recording)
    yield from _other_lenses(recording, camera)
    last = 4 + len(camera.distortion)
    yield Rival(BOARD, "the squares are not square", "", recording, (last,))
    for ratio, scaled in rescaled(camera):
        says = f"the intrinsics are of another resolution: times {significant(ratio, 3)} they fit"
        yield Rival(RESOLUTION, says, BY_SIZE, replace(recording, camera=scaled))
    for free in _MATRIX_FREE:
        yield Rival(MATRIX, "camera.K does not belong to these pictures", "", recording, free)
    for start, coefficients in _refits(camera):
        says, refitted = "the lens model does not belong to these pictures", replace(recording, camera=start)
        yield Rival(LENS, says, "", refitted, coefficients)
        yield Rival(LENS, f"{says}, nor does camera.K", "", refitted, (0, 1, 2, 3, *coefficients))


def _refits(camera: CameraModel) -> Iterator[tuple[CameraModel, tuple[int, ...]]]:
    """Lenses whose coefficients are unknowns, and the columns of these."""
    plain = np.zeros(5)
    if camera.distortion_model == OPENCV:
        plain[: min(5, len(camera.distortion))] = camera.distortion[:5]
    opencv = replace(camera, distortion=plain, distortion_model=OPENCV)
    yield opencv, (4, 5)
    yield opencv, (4, 5, 6, 7, 8)
    rational = replace(opencv, distortion=np.r_[plain, np.zeros(3)])
    yield rational, (4, 5, 6, 7, 8, 9, 10, 11)
    fisheye = (
        camera.distortion
        if camera.distortion_model == EQUIDISTANT and len(camera.distortion)
        else np.zeros(4)
    )
    yield replace(camera, distortion=fisheye, distortion_model=EQUIDISTANT), (4, 5, 6, 7)


_TAKEN_FOR: dict[int, dict[str, tuple[int, ...]]] = {
    4: {"k1 k2 p2 p1": (0, 1, 3, 2)},
    5: {
        "k1 k2 k3 p1 p2": (0, 1, 3, 4, 2),
        "k1 k2 k3 p2 p1": (0, 1, 4, 3, 2),
        "k1 k2 p2 p1 k3": (0, 1, 3, 2, 4),
    },
    8: {
        "k1 to k6 p2 p1 (Azure Kinect)": (0, 1, 7, 6, 2, 3, 4, 5),
        "k1 to k6 p1 p2": (0, 1, 6, 7, 2, 3, 4, 5),
        "k1 k2 p2 p1 k3 to k6": (0, 1, 3, 2, 4, 5, 6, 7),
    },
}
"""Orders in which other tools write coefficients, by their number: which of them stand where OpenCV's do."""


def _other_lenses(recording: Recording, camera: CameraModel) -> Iterator[Rival]:
    """Lenses with the coefficients as they stand, read otherwise."""

    def rival(says: str, cure: str, distortion: Array, model: str = OPENCV) -> Rival:
        changed = replace(camera, distortion=distortion, distortion_model=model)
        return Rival(LENS, says, cure, replace(recording, camera=changed))

    k = camera.distortion
    if not camera.is_pinhole:
        says = "the corners are of pictures that are rectified already, and are rectified once more"
        yield rival(
            says, "leave camera.distortion empty, or give the corners of the raw pictures", np.zeros(0)
        )
        says = "camera.distortion describes the inverse lens model"
        yield rival(says, "change its signs, or refit the lens", -k, camera.distortion_model)
    for order, places in _TAKEN_FOR.get(len(k), {}).items() if camera.distortion_model == OPENCV else ():
        says = f"camera.distortion is written in the order {order}"
        yield rival(says, "write it as k1 k2 p1 p2 k3 ... of OpenCV", k[list(places)])
    if camera.distortion_model == OPENCV and len(k) in (0, 4):
        says = "the lens is an equidistant one (fisheye)" + (
            ", and these are its coefficients" if len(k) else ""
        )
        yield rival(says, 'set camera.distortion_model to "equidistant"', k, EQUIDISTANT)
    if camera.distortion_model == EQUIDISTANT:
        yield rival("the lens is not an equidistant one", 'set camera.distortion_model to "opencv"', k)


def _orders(recording: Recording) -> Iterator[Rival]:
    """Corners of a grid that are listed column by column.

    Listed from the other end, or mirrored, a flat board is the same board with another frame, which harms nothing.
    """
    corners, target = recording.corners_px, recording.target
    grid = None if target is None else grid_shape(target.points_m)
    if corners is None or grid is None or grid[0] == grid[1]:
        return
    columns, rows = grid
    order = np.arange(columns * rows).reshape(columns, rows).T.ravel()
    says = (
        f"the corners do not form a {columns}x{rows} grid as declared: transposed, column by column, they do"
    )
    cure = "list the corners row by row, or exchange columns and rows of the target"
    yield Rival(ORDER, says, cure, replace(recording, corners_px=corners[:, order]), order=order)
