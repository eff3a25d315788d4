"""The diary of a recording in progress: one JSON line per sample, written through to the disk at once.

A crash costs at most the sample in progress; the next run reads the diary and goes on behind it. The line of
a sample is written after its image, and both are whole or absent.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from hecbench.errors import HecbenchError, InputError
from hecbench.system import files
from hecbench.system.pictures import encode_png

FILE_NAME = "session.jsonl"
PLAN_NAME = "plan.json"
"""The checked plan, which may be there before the recording."""
IMAGES = "images"


class SampleLine(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """What is kept of one sample. Stamps are seconds since 1970, clocks those of the devices."""

    id: str
    joints_rad: list[float] | None
    """None where only the flange's pose is known."""
    base_T_flange: list[list[float]]
    """The controller's, with its factory calibration."""
    nominal_base_T_flange: list[list[float]]
    """Our forward kinematics of the joints."""
    kinematics_gap_mm: float
    base_T_tcp: list[list[float]]
    robot_stamp_s: float
    robot_clock_s: float
    camera_stamp_s: float | None = None
    camera_clock_s: float | None = None
    image: str | None = None
    frames: list[str] = []
    image_change: float = 0.0
    """Mean grey-level difference between the first and the last frame."""
    joint_change_rad: float = 0.0
    """Largest joint difference before and after the frames."""


class _Header(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    plan: str
    robot: dict[str, Any]


class Session:
    """The folder of one recording, open for more samples."""

    def __init__(self, folder: Path, plan_digest: str, robot: dict[str, Any]) -> None:
        """Start a diary, or go on with the one that is there.

        Raises:
            InputError: The folder belongs to another plan, or is not a recording in progress.
            HecbenchError: It cannot be written.
        """
        self.folder = folder
        self.samples: list[SampleLine] = []
        self._path = folder / FILE_NAME
        if self._path.exists():
            self._resume(plan_digest)
            return
        if folder.exists() and {path.name for path in folder.iterdir()} - {PLAN_NAME}:
            raise InputError(f"{folder} is not empty and has no {FILE_NAME}: choose another --out")
        try:
            (folder / IMAGES).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise HecbenchError(
                f"{folder}: cannot be made ({error.strerror}); choose another place"
            ) from None
        files.write_bytes(self._path, msgspec.json.encode(_Header(plan=plan_digest, robot=robot)) + b"\n")

    def _resume(self, plan_digest: str) -> None:
        content = files.read_bytes(self._path)
        whole = content[: content.rfind(b"\n") + 1]
        lines = whole.splitlines()
        try:
            header = msgspec.json.decode(lines[0], type=_Header)
            self.samples = [msgspec.json.decode(line, type=SampleLine) for line in lines[1:]]
        except (IndexError, msgspec.MsgspecError) as error:
            raise InputError(f"{self._path}: {error}; remove the folder or choose another --out") from None
        if header.plan != plan_digest:
            raise InputError(f"{self.folder} was begun with another plan: choose another --out")
        if whole != content:
            files.write_bytes(self._path, whole)

    @property
    def done(self) -> set[str]:
        """Ids of the samples that are there."""
        return {sample.id for sample in self.samples}

    def save_image(self, sample_id: str, image: NDArray[np.uint8]) -> str:
        """Write one image and return its name inside the folder."""
        name = f"{IMAGES}/{sample_id}.png"
        files.write_bytes(self.folder / name, encode_png(image))
        return name

    def append(self, sample: SampleLine) -> SampleLine:
        """Add one sample for good, and return it."""
        with self._path.open("ab") as diary:
            diary.write(msgspec.json.encode(sample) + b"\n")
            diary.flush()
            os.fsync(diary.fileno())
        self.samples.append(sample)
        return sample

    def drop_last(self) -> SampleLine:
        """Take the last sample back: its line first, then its image.

        Raises:
            InputError: There is none.
        """
        if not self.samples:
            raise InputError(f"{self.folder}: has no sample to take back")
        lines = files.read_bytes(self._path).splitlines(keepends=True)
        files.write_bytes(self._path, b"".join(lines[:-1]))
        sample = self.samples.pop()
        if sample.image is not None:
            (self.folder / sample.image).unlink(missing_ok=True)
        return sample
