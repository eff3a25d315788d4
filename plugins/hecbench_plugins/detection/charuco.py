"""ChArUco boards by OpenCV: partial boards, and both layouts tried.

OpenCV 4.6 changed the layout of boards with an even number of rows (opencv#23152); whichever of the two finds
more corners is the printed one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError, TargetNotSeen
from hecbench.targets import CharucoTarget
from hecbench_plugins.detection.pictures import each

Array = NDArray[np.float64]
Grey = NDArray[np.uint8]


def find(greys: Sequence[Grey | None], target: CharucoTarget) -> tuple[CharucoTarget, list[Array | None]]:
    """Corners (P, 2) px of each picture, NaN where not seen, and the target with the layout that fits.

    Raises:
        InputError: the dictionary is unknown, or is not the printed one (the one that fits is named).
    """
    layouts = [target] if target.rows % 2 else [target, replace(target, legacy=not target.legacy)]
    found = [each(greys, _corners, layout) for layout in layouts]
    counts = [sum(np.isfinite(c[:, 0]).sum() for c in corners if c is not None) for corners in found]
    best = int(np.argmax(counts))
    if counts[best] == 0:
        raise TargetNotSeen(f"target: no image shows the ChArUco board; {_dictionary_in(greys, target)}")
    return layouts[best], found[best]


def _dictionary(name: str) -> Any:
    import cv2

    known = sorted({attribute for attribute in dir(cv2.aruco) if attribute.startswith("DICT_")})
    wanted = name if name.startswith("DICT_") else f"DICT_{name}"
    if wanted not in known:
        raise InputError(f"target.dictionary: '{name}' is not one of {', '.join(known)}")
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, wanted))


def board_of(target: CharucoTarget) -> Any:
    """OpenCV's object for the board; an `InputError` for a dictionary that it does not know."""
    import cv2

    size = target.columns, target.rows
    board = cv2.aruco.CharucoBoard(size, target.square_m, target.marker_m, _dictionary(target.dictionary))
    board.setLegacyPattern(target.legacy)
    return board


def _corners(grey: Grey, target: CharucoTarget) -> Array | None:
    import cv2

    points, ids, _, _ = cv2.aruco.CharucoDetector(board_of(target)).detectBoard(grey)
    if ids is None or len(ids) == 0:
        return None
    corners = np.full((len(target.points_m), 2), np.nan)
    corners[np.ravel(ids)] = np.asarray(points, float).reshape(-1, 2)
    return corners


def _dictionary_in(greys: Sequence[Grey | None], target: CharucoTarget) -> str:
    """The cure: which dictionary's markers the first picture shows most of."""
    import cv2

    grey = next((grey for grey in greys if grey is not None), None)
    names = [name for name in dir(cv2.aruco) if name.startswith("DICT_") and not name.endswith("000")]
    counts = {
        name: len(cv2.aruco.ArucoDetector(_dictionary(name)).detectMarkers(grey)[0])
        for name in names
        if grey is not None
    }
    best = max(counts, key=lambda name: counts[name], default=None)
    if best is None or counts[best] == 0:
        return "no marker of any dictionary is in the first image: check focus, light and size"
    return f"the first image shows {counts[best]} markers of {best}, not {target.dictionary}"
