"""Robot masks by what differs from the background that several views of a fixed camera share.

Per-pixel mode over the views (`views.scene_background`), then cleaning. Where the robot stands in most of the views,
the shared picture shows the robot, and the images alone cannot tell it from background: there the robot drawn at the
recording's start, when it has one, decides.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import Refusal
from hecbench.recording import Mounting, Recording
from hecbench.registry import hookimpl
from hecbench.specs import Need, SegmenterSpec
from hecbench_plugins.views.uncertainty import Uncertainty

Mask = NDArray[np.bool_]
Floats = NDArray[np.float32]

_FOREGROUND = 0.5
_OPENING_PX, _CLOSING_PX = 3, 5
_LARGEST_HOLE = 0.002
"""Of the image: smaller holes in a mask are closed."""
_LEAST_PIECE = 0.05
"""Of the largest piece of a mask: smaller pieces are dropped."""
_REACH_SHRINK = 4
_MOSTLY = 0.5
"""Share of the views in which the drawn robot must cover a pixel before the shared picture is doubted there."""


def by_background(recording: Recording) -> Recording:
    """The recording with a mask for every image.

    Raises:
        Refusal: the camera moves, there are too few images, or nothing moved before them.
    """
    from hecbench_plugins.views.scene_background import FEWEST_VIEWS, background, foreground

    if recording.mounting is not Mounting.EYE_TO_HAND:
        raise Refusal(
            f"{recording.name}: the camera moves with the flange, so that no background stays: give masks"
        )
    samples = [i for i, source in enumerate(recording.images or ()) if source is not None]
    if len(samples) < FEWEST_VIEWS:
        raise Refusal(
            f"{recording.name}: {len(samples)} images; a background takes {FEWEST_VIEWS}: give masks or more views"
        )
    images = np.stack([recording.image(i) for i in samples])
    scene, _ = background(images)
    unlike = foreground(images, scene)
    note = (
        f"masks: from the background of {len(samples)} views; what the robot covers in most of them stays unknown"
        " from background"
    )
    if {Need.INITIAL, Need.ROBOT_MODEL, Need.JOINTS, Need.INTRINSICS} <= recording.offers():
        found = [_cleaned(mask) for mask in _with_start(unlike, recording, samples)]
        note += " and was taken from the robot drawn at the start"
    else:
        found = [_cleaned(mask) for mask in unlike > _FOREGROUND]
    if not any(mask.any() for mask in found):
        raise Refusal(
            f"{recording.name}: nothing moves between the images: the background cannot be separated from the robot"
        )
    masks: list[NDArray[np.uint8] | None] = [None] * len(recording)
    for i, mask in zip(samples, found, strict=True):
        masks[i] = np.where(mask, np.uint8(255), np.uint8(0))
    return replace(recording, masks=tuple(masks), notes=(*recording.notes, note))


def _with_start(unlike: Floats, recording: Recording, samples: list[int]) -> Mask:
    """Masks (N, H, W) from D (N, H, W) and the robot drawn at the start.

    Where the drawn robot covers most views, and `covered = like the shared picture` holds in more of them than its
    opposite, the shared picture shows the robot, and D is turned round. What lies where no start within the
    uncertainty draws the robot is something else that moves.
    """
    from hecbench_plugins.views.silhouettes import Silhouettes

    start = recording.present.initial_parent_T_camera
    silhouettes, wide = Silhouettes(recording), Silhouettes(recording, _REACH_SHRINK)
    starts = Uncertainty().around(start)
    drawable = set(silhouettes.samples.tolist())
    places = [place for place, sample in enumerate(samples) if sample in drawable]
    covered = np.zeros(unlike.shape[1:], np.float32)
    agreement = np.zeros(unlike.shape[1:], np.float32)
    for place in places:
        drawn = silhouettes.draw(samples[place], start)
        covered += drawn
        agreement += np.where(drawn, 1 - 2 * unlike[place], 2 * unlike[place] - 1)
    turned = (covered > _MOSTLY * len(places)) & (agreement > 0)
    found = (unlike > _FOREGROUND) ^ turned
    for place in places:
        found[place] &= _enlarged(wide.reach(samples[place], starts), found[place].shape)
    return found


def _enlarged(mask: Mask, shape: tuple[int, int]) -> Mask:
    import cv2

    return np.asarray(cv2.resize(mask.astype(np.uint8), shape[::-1], interpolation=cv2.INTER_NEAREST) > 0)


def _cleaned(mask: Mask) -> Mask:
    """Without specks, small holes and small pieces."""
    import cv2

    def disk(size: int) -> NDArray[np.uint8]:
        return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)), np.uint8)

    solid = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, disk(_OPENING_PX))
    solid = cv2.morphologyEx(solid, cv2.MORPH_CLOSE, disk(_CLOSING_PX))
    _, holes, about_holes, _ = cv2.connectedComponentsWithStats(1 - solid, connectivity=4)
    small = about_holes[:, cv2.CC_STAT_AREA] < _LARGEST_HOLE * mask.size
    solid[small[holes] & (solid == 0)] = 1
    _, pieces, about_pieces, _ = cv2.connectedComponentsWithStats(solid, connectivity=8)
    areas = about_pieces[:, cv2.CC_STAT_AREA].copy()
    areas[0] = 0
    return np.asarray((areas >= max(1.0, _LEAST_PIECE * areas.max()))[pieces])


@hookimpl
def hecbench_segmenters() -> Iterable[SegmenterSpec]:
    """This file's segmenter."""
    yield SegmenterSpec(
        name="background",
        summary="what differs from the background that three or more views of a fixed camera share",
        factory=lambda: by_background,
    )
