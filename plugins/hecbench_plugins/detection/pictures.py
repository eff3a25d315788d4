"""The pictures of a recording, one by one, and what was found in them, kept by their content."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Callable, Sequence
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any, TypeVar, overload

import msgspec
import numpy as np
from numpy.typing import NDArray

from hecbench.recording import Recording
from hecbench.system import apriltags, threads
from hecbench.system.cache import Cache

Grey = NDArray[np.uint8]
Result = TypeVar("Result")

_KEPT = Cache("detections.sqlite", most_bytes=64 * 2**20)
_LIBRARIES = ("opencv-contrib-python-headless", "pupil-apriltags")
_FLIPPED = 5
"""Pictures that are tried flipped when the target is in none."""
_ARRAY = 1
"""Code of an array among MessagePack's extension types."""


class Greys(Sequence[Grey | None]):
    """A recording's images in grey (H, W), each decoded whenever it is asked for; None where there is none."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording

    def __len__(self) -> int:
        return len(self._recording)

    @overload
    def __getitem__(self, index: int) -> Grey | None: ...
    @overload
    def __getitem__(self, index: slice) -> list[Grey | None]: ...
    def __getitem__(self, index: int | slice) -> Grey | list[Grey | None] | None:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        if (self._recording.images or ())[index] is None:
            return None
        import cv2

        return np.asarray(cv2.cvtColor(self._recording.image(index), cv2.COLOR_RGB2GRAY), np.uint8)


def each(
    greys: Sequence[Grey | None], work: Callable[..., Result | None], *arguments: Any
) -> list[Result | None]:
    """`work(grey, *arguments)` for every picture, side by side; None where there is none.

    What it found in the same picture before, by the same program, is not looked for again.

    Args:
        greys: the pictures, (H, W) each.
        work: its results are arrays, numbers and lists and dicts of them. A tuple comes back as a list.
        arguments: what they are must show in their `repr`.
    """
    what = f"{work.__module__}.{work.__qualname__}{arguments!r}".encode() + _program()

    def one(index: int) -> tuple[bytes, bytes | None, bytes] | None:
        grey = greys[index]
        if grey is None:
            return None
        key = hashlib.sha256(what + str(grey.shape).encode() + np.ascontiguousarray(grey).data).digest()
        kept = _KEPT.get(key)
        return key, kept, kept or msgspec.msgpack.encode(work(grey, *arguments), enc_hook=_packed)

    found = threads.each(one, range(len(greys)))
    if new := {key: value for key, kept, value in filter(None, found) if kept is None}:
        _KEPT.put(new)
    return [None if one is None else msgspec.msgpack.decode(one[2], ext_hook=_unpacked) for one in found]


@cache
def _program() -> bytes:
    """A digest of all that decides what is found: the detectors' source and the libraries' versions."""
    digest = hashlib.sha256()
    for path in [Path(apriltags.__file__), *sorted(Path(__file__).parent.glob("*.py"))]:
        digest.update(path.read_bytes())
    for name in _LIBRARIES:
        digest.update(repr([found.version for found in metadata.distributions(name=name)]).encode())
    return digest.digest()


def mirrored(greys: Sequence[Grey | None], work: Callable[..., Any], *arguments: Any) -> str:
    """A clause that names the fault when `work` finds its target in a picture flipped left to right; else empty."""
    flipped = [None if grey is None else np.ascontiguousarray(grey[:, ::-1]) for grey in greys[:_FLIPPED]]
    count = sum(bool(found is not None and len(found)) for found in each(flipped, work, *arguments))
    if not count:
        return ""
    return f"; the images are mirrored: flipped left to right {count} of {len(flipped)} show it; turn off the mirror"


def _packed(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    stream = io.BytesIO()
    np.save(stream, value, allow_pickle=False)
    return msgspec.msgpack.Ext(_ARRAY, stream.getvalue())


def _unpacked(code: int, data: memoryview) -> NDArray[Any]:
    return np.asarray(np.load(io.BytesIO(data), allow_pickle=False))
