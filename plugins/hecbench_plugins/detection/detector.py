"""From images to `corners_px`: the target found, its orientation settled, an unknown camera calibrated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hecbench.errors import InputError, TargetNotSeen
from hecbench.recording import CameraModel, Recording
from hecbench.se3 import Array
from hecbench.targets import (
    AprilTagTarget,
    CharucoTarget,
    ChessboardTarget,
    MarkersTarget,
    PointsTarget,
    Target,
    grid_shape,
)
from hecbench_plugins.detection import apriltag, charuco, chessboard, circles, markers
from hecbench_plugins.detection.intrinsics import calibrate
from hecbench_plugins.detection.orientation import choose_turns, turned_grids
from hecbench_plugins.detection.pictures import Grey, Greys, each

Found = list[Array | None]


def detect(recording: Recording, *, refit_intrinsics: bool = False) -> Recording:
    """The recording with `corners_px` from its images; `notes` say what was found and decided.

    A target of kind points is looked for when its points form a grid: as a chessboard, then as circles.
    Unknown intrinsics are calibrated from the same images. Boards that look the same upside down are turned
    as the hand motion demands. A given `camera_T_target` is dropped: corners say more.

    Args:
        recording: with images and a target.
        refit_intrinsics: calibrate the camera although K is given (nominal intrinsics).

    Raises:
        InputError: images or target are missing or unreadable.
        TargetNotSeen: no image shows the target.
    """
    if recording.images is None or all(image is None for image in recording.images):
        raise InputError(f"{recording.name}: has no images to detect the target in")
    if recording.target is None:
        raise InputError(f"{recording.name}: does not say what target its images show; describe the target")
    greys = Greys(recording)
    target, found, grid = _find(greys, recording.target)
    seen = [i for i, corners in enumerate(found) if corners is not None]
    if not seen:
        raise TargetNotSeen(
            f"{recording.name}: no image shows the {target.kind}; check its size in points, and the pictures"
        )
    corners_px = np.full((len(recording), len(target.points_m), 2), np.nan)
    for i in seen:
        corners_px[i] = found[i]
    images = sum(image is not None for image in recording.images)
    notes = [f"{target.kind} found in {len(seen)} of {images} images"]
    if isinstance(target, CharucoTarget) and target != recording.target:
        notes.append(f"its layout is {'legacy' if target.legacy else 'new'}, not as declared (OpenCV 4.6)")
    if isinstance(target, MarkersTarget) and target != recording.target:
        notes.append(f"its first id is {target.first_id}")
    if isinstance(target, AprilTagTarget) and target != recording.target:
        notes.append(f"its id is {target.id}")
    camera = recording.camera
    if camera is None or camera.K is None or refit_intrinsics:
        camera, note = _calibrated(recording, target, corners_px, greys)
        notes.append(note)
    changed = replace(recording, camera=camera, target=target, corners_px=corners_px, camera_T_target=None)
    if grid is not None:
        changed, turned = _turn(changed, grid)
        notes.append(turned)
    return replace(changed, notes=(*recording.notes, f"{recording.name}: " + "; ".join(filter(None, notes))))


def _find(greys: Sequence[Grey | None], target: Target) -> tuple[Target, Found, tuple[int, int] | None]:
    """The target with what the images settle, its points in each image, and (columns, rows) of a grid whose
    orientation they do not settle."""
    match target:
        case AprilTagTarget():
            return *apriltag.find(greys, target), None
        case CharucoTarget():
            return *charuco.find(greys, target), None
        case MarkersTarget():
            return *markers.find(greys, target), None
        case ChessboardTarget():
            shape = target.columns, target.rows
            return target, each(greys, chessboard.corners, *shape), shape if _looks_alike(*shape) else None
        case PointsTarget() if grid := grid_shape(target.points_m):
            if _shows_circles(greys, grid):
                found = each(greys, circles.centres, *grid)
                marked = all(centres[1] for centres in found if centres is not None)
                return target, [centres and centres[0] for centres in found], None if marked else grid
            return target, each(greys, chessboard.corners, *grid), grid if _looks_alike(*grid) else None
    raise InputError(
        "target.points_m: points that form no flat grid cannot be found in images; give corners_px"
    )


def _shows_circles(greys: Sequence[Grey | None], grid: tuple[int, int]) -> bool:
    """Whether the first picture that shows a chessboard or circles shows circles."""
    for grey in greys:
        if each([grey], chessboard.corners, *grid)[0] is not None:
            return False
        if each([grey], circles.centres, *grid)[0] is not None:
            return True
    return False


def _looks_alike(columns: int, rows: int) -> bool:
    """Whether a chessboard with so many inner corners looks the same upside down."""
    return (columns + rows) % 2 == 0


def _calibrated(
    recording: Recording, target: Target, corners_px: Array, greys: Sequence[Grey | None]
) -> tuple[CameraModel, str]:
    height, width = next(grey.shape for grey in greys if grey is not None)
    try:
        result = calibrate(target.points_m, corners_px, (width, height))
    except InputError as error:
        raise InputError(f"{recording.name}: {error}") from error
    return result.camera, str(result)


def _turn(recording: Recording, shape: tuple[int, int]) -> tuple[Recording, str]:
    """Read each board from the end that the hand motion demands."""
    from hecbench_plugins.markers.target_poses import planar_candidates

    corners = recording.present.corners_px
    columns, rows = shape
    seen = np.isfinite(corners).all((1, 2))
    if recording.base_T_flange is not None:
        seen &= np.isfinite(recording.base_T_flange).all((1, 2))
    if recording.base_T_flange is None or seen.sum() < 3:
        return recording, "which end of the board is first stays open: too few samples with robot poses"
    chosen = np.flatnonzero(seen)
    ways = [turned_grids(grid) for grid in corners[chosen].reshape(-1, rows, columns, 2)]
    readings = np.array(ways).reshape(len(chosen), len(ways[0]), rows * columns, 2)
    part = recording.subset(chosen)
    poses = np.stack(
        [planar_candidates(replace(part, corners_px=readings[:, k]))[0][:, 0] for k in range(len(ways[0]))], 1
    )
    turns = choose_turns(part.hand_poses(), poses)
    settled = corners.copy()
    settled[chosen] = readings[np.arange(len(chosen)), turns]
    note = f"{np.count_nonzero(turns)} boards turned, as the hand motion demands" if turns.any() else ""
    return replace(recording, corners_px=settled), note
