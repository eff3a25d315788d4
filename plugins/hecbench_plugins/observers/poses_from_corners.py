"""camera_T_target from corners, once for all solvers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import Need, ObserverSpec
from hecbench_plugins.markers.target_poses import target_poses


def poses_from_corners(recording: Recording) -> Recording:
    """The recording with `camera_T_target` by PnP; see `target_poses`."""
    return replace(recording, camera_T_target=target_poses(recording))


@hookimpl
def hecbench_observers() -> Iterable[ObserverSpec]:
    """This file's observation."""
    yield ObserverSpec(
        name="poses_from_corners",
        summary="target poses by PnP; the hand motion decides between planar solutions",
        imports=("cv2",),
        gives=Need.TARGET_POSES,
        applies=lambda recording: (
            recording.camera_T_target is None and {Need.CORNERS, Need.INTRINSICS} <= recording.offers()
        ),
        factory=lambda: poses_from_corners,
    )
