"""Photographs with the robot and the target drawn where an answer places them, for the first screen of the page."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hecbench import lens, se3
from hecbench.errors import HecbenchError, InputError
from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.rendering.undistort import Undistortion
from hecbench.report.overlay import Overlay
from hecbench.samples.spread import evenly
from hecbench.se3 import Array
from hecbench.system import files

Picture = NDArray[np.uint8]

FOLDER = "verdict_pictures"
"""A name of ours: older pictures in it are deleted."""
_COUNT = 8
_WIDEST_PX = 960
_QUALITY = 78
_SEEN_RGB, _PREDICTED_RGB = (40, 220, 60), (255, 90, 30)


def write(recording: Recording, estimate: Estimate, folder: Path) -> list[Path]:
    """``verdict_pictures/<sample>.jpg`` of samples spread over a prepared recording; unreadable images are skipped."""
    place = folder / FOLDER
    for old in place.glob("*.jpg"):
        old.unlink()
    if estimate.parent_T_camera is None or recording.camera is None or recording.camera.K is None:
        return []
    written = []
    base = _drawer(recording, estimate)
    for sample in _chosen(recording):
        try:
            picture = base(sample)
        except InputError:  # the page shows what can be shown; `check` names damaged images
            continue
        path = place / f"{files.safe_name(recording.sample_ids[sample])}.jpg"
        files.write_bytes(path, _jpeg(_with_target(picture, recording, estimate, sample)))
        written.append(path)
    return written


def _chosen(recording: Recording) -> list[int]:
    """Samples with an image and a robot pose, evenly spread."""
    images = recording.images or ()
    posed = recording.base_T_flange
    usable = [
        i
        for i, image in enumerate(images)
        if image is not None and (posed is None or np.isfinite(posed[i]).all())
    ]
    return [usable[i] for i in evenly(len(usable), _COUNT)]


def _drawer(recording: Recording, estimate: Estimate) -> Callable[[int], Picture]:
    """The undistorted photograph, with the robot drawn over it where its model and joints are known."""
    X, undistorted = estimate.pose, Undistortion.of(recording.present.camera)

    def plain(sample: int) -> Picture:
        picture = undistorted.image(np.asarray(recording.image(sample)))
        return np.asarray(np.round(255 * np.clip(picture, 0, 1)), np.uint8)

    try:
        overlay = Overlay(recording)
    except HecbenchError:  # no robot model, or none that can be read: the photograph alone
        return plain
    return lambda sample: overlay.draw(sample, X) if sample in overlay.samples else plain(sample)


def _with_target(picture: Picture, recording: Recording, estimate: Estimate, sample: int) -> Picture:
    """Rings where the target's points were seen, crosses where the answer predicts them."""
    from PIL import Image, ImageDraw

    camera, target = recording.present.camera, recording.target
    if target is None or recording.base_T_flange is None:
        return picture
    image = Image.fromarray(picture)
    draw = ImageDraw.Draw(image)
    size = max(camera.width / 320, 2.0)
    if recording.corners_px is not None:
        seen = recording.corners_px[sample]
        seen = seen[np.isfinite(seen).all(1)]
        for u, v in lens.normalised(camera, seen) @ camera.intrinsics[:2, :2].T + camera.intrinsics[:2, 2]:
            draw.ellipse((u - size, v - size, u + size, v + size), outline=_SEEN_RGB, width=1)
    carrier_T_target = _target_pose(recording, estimate)
    if carrier_T_target is not None:
        placed = se3.inverse(estimate.pose) @ recording.hand_poses()[sample] @ carrier_T_target
        points = se3.transform_points(placed, target.points_m)
        points = points[points[:, 2] > 0] @ camera.intrinsics.T
        for u, v in points[:, :2] / points[:, 2:]:
            draw.line((u - size, v, u + size, v), fill=_PREDICTED_RGB)
            draw.line((u, v - size, u, v + size), fill=_PREDICTED_RGB)
    return np.asarray(image)


def _target_pose(recording: Recording, estimate: Estimate) -> Array | None:
    """carrier_T_target of the answer, or the mean of what the samples see of it."""
    if estimate.carrier_T_target is not None or recording.camera_T_target is None:
        return estimate.carrier_T_target
    seen = se3.inverse(recording.hand_poses()) @ estimate.pose @ recording.camera_T_target
    seen = seen[np.isfinite(seen).all((1, 2))]
    return se3.mean(seen) if len(seen) else None


def _jpeg(picture: Picture) -> bytes:
    from PIL import Image

    image = Image.fromarray(picture)
    image.thumbnail((_WIDEST_PX, _WIDEST_PX))
    stream = io.BytesIO()
    image.save(stream, "JPEG", quality=_QUALITY)
    return stream.getvalue()


def load(folder: Path) -> dict[str, bytes]:
    """The pictures beside a page, by sample."""
    return {path.stem: path.read_bytes() for path in sorted((folder / FOLDER).glob("*.jpg"))}
