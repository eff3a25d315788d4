"""ONNX graphs that OpenCV runs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2

from hecbench.errors import InputError


@contextmanager
def runnable(path: Path) -> Iterator[None]:
    """Loading the graph of a file, or its first run.

    Raises:
        InputError: OpenCV fails at it.
    """
    try:
        yield
    except cv2.error as error:
        reason = " ".join(str(error).split())[-160:]
        raise InputError(f"{path}: OpenCV cannot run this graph: {reason}") from None
