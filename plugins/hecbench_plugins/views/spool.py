"""Pictures kept outside memory: in a temporary file without a name, which the system removes with the process."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import HecbenchError
from hecbench.system import threads

Picture = NDArray[np.uint8]


class Spool:
    """N pictures of one shape; each is read when it is asked for, into an array of the caller's own."""

    def __init__(self, descriptor: _Descriptor, shape: tuple[int, ...], rows: Sequence[int]) -> None:
        self._descriptor, self._shape, self._rows = descriptor, shape, rows
        self._bytes = int(np.prod(shape))

    @staticmethod
    def of(make: Callable[[int], Picture], count: int) -> Spool:
        """The pictures 0 to `count` - 1, one or more, that `make` makes, in threads.

        Raises:
            HecbenchError: the temporary folder cannot hold them.
        """
        descriptor = _Descriptor()

        def one(row: int) -> tuple[int, ...]:
            picture = np.ascontiguousarray(make(row), np.uint8)
            descriptor.write(picture, row * picture.nbytes)
            return picture.shape

        return Spool(descriptor, threads.each(one, range(count))[0], range(count))

    @property
    def shape(self) -> tuple[int, ...]:
        """(N, H, W, 3)."""
        return len(self), *self._shape

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, index: int) -> Picture:
        picture = np.empty(self._shape, np.uint8)
        self._descriptor.read(picture, self._rows[index] * self._bytes)
        return picture

    def read_rows(self, index: int, first: int, last: int, out: Picture) -> None:
        """Fill the rows `first` to `last`, exclusive, of `out` (H, W, 3) with those of a picture."""
        row_bytes = self._bytes // self._shape[0]
        self._descriptor.read(out[first:last], self._rows[index] * self._bytes + first * row_bytes)

    def rows(self, first: int, last: int) -> Picture:
        """The rows `first` to `last`, exclusive, of all pictures: (N, last - first, W, 3)."""
        found = np.empty((len(self), last - first, *self._shape[1:]), np.uint8)
        row_bytes = self._bytes // self._shape[0]
        for row, place in zip(self._rows, found, strict=True):
            self._descriptor.read(place, row * self._bytes + first * row_bytes)
        return found

    def __iter__(self) -> Iterator[Picture]:
        return (self[index] for index in range(len(self)))

    def subset(self, indices: Sequence[int]) -> Spool:
        """Some of the pictures, in the same file."""
        return Spool(self._descriptor, self._shape, [self._rows[index] for index in indices])


class _Descriptor:
    """The file; it is closed, and thereby removed, with the last spool that uses it."""

    def __init__(self) -> None:
        self._file = tempfile.TemporaryFile()  # noqa: SIM115 it lives as long as this

    def write(self, picture: Picture, place: int) -> None:
        try:
            written = os.pwrite(self._file.fileno(), picture.data, place)
        except OSError as error:
            raise self._full(error.strerror) from error
        if written < picture.nbytes:
            raise self._full("it is full")

    def read(self, picture: Picture, place: int) -> None:
        if os.preadv(self._file.fileno(), [picture.data], place) < picture.nbytes:
            raise self._full("a picture was cut off")

    @staticmethod
    def _full(reason: str | None) -> HecbenchError:
        folder = tempfile.gettempdir()
        return HecbenchError(f"{folder}: cannot hold the undistorted photographs ({reason}); set TMPDIR")
