"""A folder of images as a camera: each grab serves the next file in the order of the names."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from hecbench.errors import InputError
from hecbench.recording import CameraModel
from hecbench.registry import hookimpl
from hecbench.specs import DeviceSpec, Kind
from hecbench.system import pictures
from hecbench_hardware.devices import DeviceFault, Fault, Frame
from hecbench_hardware.options import flag, text

SUFFIXES = {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff"}


@dataclass
class ImageFolder:
    """Ends with a fault after the last image, unless it loops."""

    folder: Path
    loop: bool = False
    name: str = field(init=False)
    _next: int = 0

    def __post_init__(self) -> None:
        """List the images."""
        self.name = f"camera {self.folder}"
        if not self.folder.is_dir():
            raise InputError(f"{self.folder} is not a folder: give folder=... with images in it")
        self._files = sorted(path for path in self.folder.iterdir() if path.suffix.lower() in SUFFIXES)
        if not self._files:
            raise InputError(
                f"{self.folder} holds no image: give a folder with {', '.join(sorted(SUFFIXES))}"
            )

    def grab(self, timeout_s: float = 2.0) -> Frame:
        """The next image as RGB."""
        if self._next >= len(self._files) and not self.loop:
            raise DeviceFault(Fault.CAMERA, self.name, f"all {len(self._files)} images are used")
        path = self._files[self._next % len(self._files)]
        try:
            image = pictures.image(path, path.name)
        except InputError as error:
            raise DeviceFault(Fault.CAMERA, self.name, str(error)) from None
        self._next += 1
        return Frame(image, time.time(), None, path.name)

    def intrinsics(self) -> CameraModel | None:
        """Files know nothing of their optics."""
        return None

    def close(self) -> None:
        """Nothing to let go of."""


@hookimpl
def hecbench_cameras() -> Iterable[DeviceSpec]:
    """The folder."""

    def open_folder(options: Mapping[str, str]) -> ImageFolder:
        return ImageFolder(Path(text(options, "folder")), flag(options, "loop"))

    yield DeviceSpec(
        name="images",
        kind=Kind.CAMERA,
        summary="a folder of images, one per grab",
        open=open_folder,
        simulated=True,
        options=("folder", "loop"),
    )
