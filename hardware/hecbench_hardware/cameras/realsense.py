"""The colour stream of an Intel RealSense through pyrealsense2, with the intrinsics that the device knows."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from hecbench.errors import InputError
from hecbench.recording import CameraModel
from hecbench.registry import hookimpl
from hecbench.specs import DeviceSpec, Kind
from hecbench_hardware.devices import DeviceFault, Fault, Frame
from hecbench_hardware.options import number, text

_WARM_UP_FRAMES = 15
"""Frames that the automatic exposure takes to settle before it is locked."""


class RealSenseCamera:
    """Streams until `close`; automatic exposure is locked after a moment."""

    def __init__(self, serial: str = "", *, width: int = 1280, height: int = 720, rate_hz: int = 15) -> None:
        """The device of that serial number, or the first."""
        import pyrealsense2 as rs

        self.name = f"camera RealSense {serial}".strip()
        if not len(rs.context().devices):
            raise InputError(f"{self.name} is not connected: check its USB 3 cable")
        config = rs.config()
        if serial:
            config.enable_device(serial)
        config.enable_stream(rs.stream.color, width, height, rs.format.rgb8, rate_hz)
        self._pipeline: Any = rs.pipeline()
        try:
            profile = self._pipeline.start(config)
        except RuntimeError as error:
            raise InputError(
                f"{self.name} does not stream {width}x{height} at {rate_hz} Hz ({error}): try another size"
            ) from None
        self._optics = profile.get_stream(rs.stream.color).as_video_stream_profile().get_intrinsics()
        plain = (rs.distortion.none, rs.distortion.brown_conrady)
        self._is_opencv = self._optics.model in plain or not any(self._optics.coeffs)
        for _ in range(_WARM_UP_FRAMES):
            self.grab()
        profile.get_device().first_color_sensor().set_option(rs.option.enable_auto_exposure, 0)

    def grab(self, timeout_s: float = 2.0) -> Frame:
        """A frame that was exposed after the call: the one in the queue is older and is dropped."""
        try:
            self._pipeline.poll_for_frames()
            frame = self._pipeline.wait_for_frames(int(timeout_s * 1e3)).get_color_frame()
        except RuntimeError:
            raise DeviceFault(Fault.CAMERA, self.name, f"no frame within {timeout_s:.1f} s") from None
        image = np.array(frame.get_data(), np.uint8)
        return Frame(image, time.time(), frame.get_timestamp() * 1e-3, f"frame {frame.get_frame_number()}")

    def intrinsics(self) -> CameraModel | None:
        """As calibrated in the factory; None for a lens model other than OpenCV's."""
        if not self._is_opencv:
            return None
        optics = self._optics
        K = np.array([[optics.fx, 0, optics.ppx], [0, optics.fy, optics.ppy], [0, 0, 1]])
        return CameraModel(optics.width, optics.height, K, np.array(optics.coeffs, float))

    def close(self) -> None:
        """Stop the stream."""
        pipeline, self._pipeline = self._pipeline, None
        if pipeline:
            pipeline.stop()


@hookimpl
def hecbench_cameras() -> Iterable[DeviceSpec]:
    """Every RealSense with a colour sensor."""

    def open_realsense(options: Mapping[str, str]) -> RealSenseCamera:
        width, height = int(number(options, "width", 1280)), int(number(options, "height", 720))
        rate_hz = int(number(options, "rate_hz", 15))
        return RealSenseCamera(text(options, "serial", ""), width=width, height=height, rate_hz=rate_hz)

    yield DeviceSpec(
        name="realsense",
        kind=Kind.CAMERA,
        summary="the colour stream of an Intel RealSense through pyrealsense2",
        imports=("pyrealsense2",),
        open=open_realsense,
        simulated=False,
        options=("serial", "width", "height", "rate_hz"),
    )
