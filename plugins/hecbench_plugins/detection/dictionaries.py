"""OpenCV's dictionaries of square markers by name, and which of them a picture shows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError

Grey = NDArray[np.uint8]


def named(name: str) -> Any:
    """OpenCV's dictionary, with or without the prefix DICT_.

    Raises:
        InputError: there is none of that name.
    """
    import cv2

    known = sorted({attribute for attribute in dir(cv2.aruco) if attribute.startswith("DICT_")})
    wanted = name if name.startswith("DICT_") else f"DICT_{name}"
    if wanted not in known:
        raise InputError(f"target.dictionary: '{name}' is not one of {', '.join(known)}")
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, wanted))


def shown_in(greys: Sequence[Grey | None], declared: str) -> str:
    """The cure: which dictionary's markers the first picture shows most of."""
    import cv2

    grey = next((grey for grey in greys if grey is not None), None)
    names = [name for name in dir(cv2.aruco) if name.startswith("DICT_") and not name.endswith("000")]
    counts = {
        name: len(cv2.aruco.ArucoDetector(named(name)).detectMarkers(grey)[0])
        for name in names
        if grey is not None
    }
    best = max(counts, key=lambda name: counts[name], default=None)
    if best is None or counts[best] == 0:
        return "no marker of any dictionary is in the first image: check focus, light and size"
    return f"the first image shows {counts[best]} markers of {best}, not {declared}"
