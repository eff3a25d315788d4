"""A USB camera, or a video file in its place, through OpenCV."""

from __future__ import annotations

import threading
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

_BUFFERED = 2
"""Frames that a driver may hold back although it is asked for one; they are skipped."""


class UvcCamera:
    """Opened until `close`. Focus and exposure are locked when the device allows it."""

    def __init__(
        self, device: str, *, width: int = 0, height: int = 0, exposure: float | None = None
    ) -> None:
        """`device` is an index or a path; sizes of 0 keep the device's own."""
        import cv2

        self.name = f"camera {device}"
        self._live = device.isdigit()
        self._capture: Any = cv2.VideoCapture(int(device) if self._live else device)
        if not self._capture.isOpened():
            raise InputError(
                f"{self.name} cannot be opened: check its number in /dev/video* and the permissions"
            )
        wanted: dict[int, float] = {cv2.CAP_PROP_BUFFERSIZE: 1, cv2.CAP_PROP_AUTOFOCUS: 0}
        if width and height:
            wanted |= {cv2.CAP_PROP_FRAME_WIDTH: width, cv2.CAP_PROP_FRAME_HEIGHT: height}
        if exposure is not None:
            wanted |= {cv2.CAP_PROP_AUTO_EXPOSURE: 1, cv2.CAP_PROP_EXPOSURE: exposure}
        for key, value in wanted.items():
            self._capture.set(key, value)
        self._count = 0

    def grab(self, timeout_s: float = 2.0) -> Frame:
        """A frame that was exposed after the call."""
        import cv2

        answer: list[Any] = []

        def read() -> None:
            for _ in range(_BUFFERED if self._live else 0):
                self._capture.grab()
            answer.append(self._capture.read())

        reader = threading.Thread(target=read, daemon=True)
        reader.start()
        reader.join(timeout_s)
        if not answer or not answer[0][0]:
            reason = "no more frames" if answer else f"no frame within {timeout_s:.1f} s"
            raise DeviceFault(Fault.CAMERA, self.name, reason)
        self._count += 1
        image = np.asarray(cv2.cvtColor(answer[0][1], cv2.COLOR_BGR2RGB), np.uint8)
        return Frame(image, time.time(), None, f"frame {self._count}")

    def intrinsics(self) -> CameraModel | None:
        """A webcam does not know its optics."""
        return None

    def close(self) -> None:
        """Release the device."""
        self._capture.release()


@hookimpl
def hecbench_cameras() -> Iterable[DeviceSpec]:
    """Any camera that the system shows as video."""

    def open_uvc(options: Mapping[str, str]) -> UvcCamera:
        exposure = number(options, "exposure", 0.0) if "exposure" in options else None
        width, height = int(number(options, "width", 0)), int(number(options, "height", 0))
        return UvcCamera(text(options, "device", "0"), width=width, height=height, exposure=exposure)

    yield DeviceSpec(
        name="uvc",
        kind=Kind.CAMERA,
        summary="a USB camera by index, or a video file by path",
        imports=("cv2",),
        open=open_uvc,
        simulated=False,
        options=("device", "width", "height", "exposure"),
    )
