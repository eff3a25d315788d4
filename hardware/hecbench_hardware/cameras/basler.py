"""A Basler camera through pypylon, whose own emulator (``PYLON_CAMEMU``) stands in for hardware."""

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
from hecbench_hardware.options import text

_LOCKED = {"ExposureAuto": "Off", "GainAuto": "Off"}
"""Set when the camera has them: a changing exposure moves edges."""
_TICKS_PER_S = 1e9


class BaslerCamera:
    """Opened until `close`; grabs one frame per call, as RGB."""

    def __init__(self, serial: str = "", features: Mapping[str, str] | None = None) -> None:
        """The camera of that serial number, or the first; `features` are GenICam names and values."""
        from pypylon import genicam, pylon

        self.name = f"camera Basler {serial}".strip()
        self._genicam, self._count = genicam, 0
        factory = pylon.TlFactory.GetInstance()
        found = [info for info in factory.EnumerateDevices() if serial in ("", info.GetSerialNumber())]
        if not found:
            known = ", ".join(info.GetSerialNumber() for info in factory.EnumerateDevices()) or "none"
            raise InputError(f"{self.name} is not connected (there are: {known}): check its cable and power")
        self._camera: Any = pylon.InstantCamera(factory.CreateDevice(found[0]))
        try:
            self._camera.Open()
        except genicam.GenericException:
            raise InputError(
                f"{self.name} cannot be opened: close the program that uses it, pylon Viewer perhaps"
            ) from None
        for name, value in _LOCKED.items():
            if self._camera.GetNodeMap().GetNode(name):
                self._set(name, value)
        for name, value in (features or {}).items():
            self._set(name, value)
        self._converter = pylon.ImageFormatConverter()
        self._converter.OutputPixelFormat = pylon.PixelType_RGB8packed

    def _set(self, name: str, value: str) -> None:
        node = self._camera.GetNodeMap().GetNode(name)
        try:
            node.FromString(value)
        except (AttributeError, self._genicam.GenericException):
            self.close()
            raise InputError(f"{self.name} has no feature {name} that takes '{value}'") from None

    def grab(self, timeout_s: float = 2.0) -> Frame:
        """A frame that was exposed after the call."""
        if not self._camera.IsOpen():
            raise DeviceFault(Fault.CAMERA, self.name, "it is closed")
        try:
            with self._camera.GrabOne(int(timeout_s * 1e3)) as result:
                if not result.GrabSucceeded():
                    raise DeviceFault(Fault.CAMERA, self.name, result.GetErrorDescription())
                image = np.array(self._converter.Convert(result).GetArray(), np.uint8)
                self._count += 1
                stamp_s = result.TimeStamp / _TICKS_PER_S or None
                return Frame(image, time.time(), stamp_s, f"frame {self._count}")
        except self._genicam.GenericException:
            raise DeviceFault(Fault.CAMERA, self.name, f"no frame within {timeout_s:.1f} s") from None

    def intrinsics(self) -> CameraModel | None:
        """The body does not know its lens."""
        return None

    def close(self) -> None:
        """Release the device."""
        self._camera.Close()


def open_basler(options: Mapping[str, str]) -> BaslerCamera:
    """Options: serial, features as ``Name=Value;Name=Value``."""
    features = {}
    for pair in filter(None, text(options, "features", "").split(";")):
        name, separator, value = pair.partition("=")
        if not separator:
            raise InputError(f"features={pair} is not Name=Value;Name=Value")
        features[name] = value
    return BaslerCamera(text(options, "serial", ""), features)


@hookimpl
def hecbench_cameras() -> Iterable[DeviceSpec]:
    """Every Basler camera that pylon finds."""
    yield DeviceSpec(
        name="basler",
        kind=Kind.CAMERA,
        summary="a Basler camera through pypylon",
        imports=("pypylon",),
        open=open_basler,
        simulated=False,
        options=("serial", "features"),
    )
