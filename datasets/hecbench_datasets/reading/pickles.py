"""Pickles of plain values and arrays, read without running what a pickle may ask for.

NumPy takes the state of a pickled dtype on trust, and one with forged fields makes it follow a chosen pointer. So
arrays are made here, from bytes and the name of a number's type, by an unpickler that knows no other operations.
"""

from __future__ import annotations

import io
import pickle
import re
from collections import OrderedDict
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import DTypeLike, NDArray

from hecbench.errors import InputError
from hecbench.system import files
from hecbench_datasets.reading.sources import bounded

_NUMBER = re.compile(r"[biuf][1248]")
_MOST_TEXT = 1 << 26
"""Characters made into bytes (Python 2's way to pickle bytes), since one text may be used many times."""
_REFUSED = {
    operation[0]
    for operation in (
        *(pickle.PERSID, pickle.BINPERSID, pickle.NEXT_BUFFER, pickle.READONLY_BUFFER),
        *(pickle.INST, pickle.OBJ, pickle.NEWOBJ, pickle.NEWOBJ_EX, pickle.EXT1, pickle.EXT2, pickle.EXT4),
    )
}


class _Type:
    """Stands for a dtype: that of a plain number, in some order of bytes."""

    def __init__(self, name: str, *_: object) -> None:
        if not isinstance(name, str) or not _NUMBER.fullmatch(name):
            raise pickle.UnpicklingError(f"it holds an array of {name!r}, not of numbers")
        self.value = np.dtype(name)

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        order, *structure = state[1:5]
        if structure != [None] * 3 or order not in ("<", ">", "|", "="):
            raise pickle.UnpicklingError("it holds an array of structures, not of numbers")
        self.value = self.value.newbyteorder(order)


class _Numbers:
    """Stands for an array: a view of its bytes."""

    def __init__(self, *_: object) -> None:
        self.value: NDArray[Any] = np.empty(0)

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        _, shape, kind, fortran, content = state
        self.value = _view(content, kind, shape, "F" if fortran else "C").value

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        return np.asarray(self.value, dtype)


def _view(content: bytes, kind: _Type, shape: tuple[int, ...] = (), order: str = "C") -> _Numbers:
    numbers = _Numbers()
    numbers.value = np.frombuffer(content, kind.value).reshape(shape, order=order)  # type: ignore[call-overload]
    return numbers


class _Plain(pickle._Unpickler):
    """Builds dicts, lists, numbers, texts and arrays, and nothing else.

    The unpickler written in Python: the memory of the other one grows with an index that the file names.
    """

    dispatch: ClassVar[dict[int, Any]] = {
        code: load for code, load in pickle._Unpickler.dispatch.items() if code not in _REFUSED
    }
    dispatch[pickle.BYTEARRAY8[0]] = dispatch[
        pickle.BINBYTES8[0]
    ]  # the other sets memory aside before it reads
    _left = _MOST_TEXT

    def find_class(self, module: str, name: str) -> Any:
        allowed = {
            ("numpy.core.multiarray", "_reconstruct"): _Numbers,
            ("numpy.core.multiarray", "scalar"): lambda kind, content: _view(content, kind).value[()],
            ("numpy.core.numeric", "_frombuffer"): _view,
            ("numpy", "ndarray"): None,
            ("numpy", "dtype"): _Type,
            ("_codecs", "encode"): self._encoded,
            ("collections", "OrderedDict"): OrderedDict,
        }
        wanted = module.replace("numpy._core", "numpy.core"), name
        if wanted not in allowed:
            raise pickle.UnpicklingError(f"it asks for {module}.{name}")
        return allowed[wanted]

    def _encoded(self, text: str, _: str) -> bytes:
        self._left -= len(text)
        if self._left < 0:
            raise pickle.UnpicklingError("it holds too much text")
        return text.encode("latin1")


def plain_pickle(path: Path) -> Any:
    """The value in a pickle that holds nothing but plain values and arrays; arrays are made by `np.asarray`.

    Raises:
        InputError: it is no pickle, is cut, or asks for anything else.
    """
    try:
        value = _Plain(io.BytesIO(files.read_bytes(path)), encoding="latin1").load()
        return bounded(value, str(path))
    except InputError:
        raise
    except Exception as error:  # a damaged pickle raises nearly anything
        raise InputError(f"{path}: is not a pickle of plain values ({error}); fetch the set again") from error
