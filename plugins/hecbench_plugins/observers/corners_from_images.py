"""Target corners from images, and the intrinsics where they are unknown, once for all solvers."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from hecbench.errors import Refusal, TargetNotSeen
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import Need, ObserverSpec


def corners_from_images(recording: Recording) -> Recording:
    """The recording with `corners_px`; see `hecbench_plugins.detection.detect`."""
    from hecbench_plugins.detection import detect

    absent = [
        str(image) for image in recording.images or () if isinstance(image, Path) and not image.exists()
    ]
    if absent:
        raise Refusal(
            f"{len(absent)} images are not there, the first is {absent[0]}: the target cannot be detected"
        )
    try:
        return detect(recording)
    except TargetNotSeen as error:
        raise Refusal(str(error)) from error


@hookimpl
def hecbench_observers() -> Iterable[ObserverSpec]:
    """This file's observation."""
    yield ObserverSpec(
        name="corners_from_images",
        summary="AprilTag, chessboard, ChArUco or circle grid, detected; unknown intrinsics calibrated",
        imports=("cv2",),
        gives=Need.CORNERS,
        applies=lambda recording: (
            recording.corners_px is None
            and recording.camera_T_target is None
            and recording.target is not None
            and Need.IMAGES in recording.offers()
        ),
        factory=lambda: corners_from_images,
    )
