"""Target points in images: `detect` fills `corners_px`, and the intrinsics when they are unknown."""

from hecbench_plugins.detection.detector import detect
from hecbench_plugins.detection.overlay import overlay, write_overlays

__all__ = ["detect", "overlay", "write_overlays"]
