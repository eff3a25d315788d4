"""Pickles of plain values and arrays, read without running what a pickle may ask for."""

from __future__ import annotations

import io
import pickle
from pathlib import Path
from typing import Any

from hecbench import files
from hecbench.errors import InputError

_ALLOWED = {
    *(
        (f"numpy.{core}.multiarray", name)
        for core in ("core", "_core")
        for name in ("_reconstruct", "scalar")
    ),
    *((f"numpy.{core}.numeric", "_frombuffer") for core in ("core", "_core")),
    ("numpy", "ndarray"),
    ("numpy", "dtype"),
    ("_codecs", "encode"),
    ("collections", "OrderedDict"),
}


class _Plain(pickle.Unpickler):
    """Builds dicts, lists, numbers, texts and numpy arrays, and nothing else."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in _ALLOWED:
            raise pickle.UnpicklingError(f"it asks for {module}.{name}")
        return super().find_class(module, name)


def plain_pickle(path: Path) -> Any:
    """The value in a pickle that holds nothing but plain values and arrays.

    Raises:
        InputError: it is no pickle, is cut, or asks for anything else.
    """
    try:
        return _Plain(io.BytesIO(files.read_bytes(path)), encoding="latin1").load()
    except InputError:
        raise
    except Exception as error:  # a damaged pickle raises nearly anything
        raise InputError(f"{path}: is not a pickle of plain values ({error}); fetch the set again") from error
