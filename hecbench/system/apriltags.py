"""AprilTags in a picture by pupil-apriltags or, where it has no wheel (Python 3.14), by OpenCV.

Detection: Wang and Olson 2016, "AprilTag 2: efficient and robust fiducial detection". The library puts pixel centres at
half integers, ours lie at integers. It orders corners as the recording format does: bottom-left, bottom-right,
top-right, top-left of the official tag.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from threading import get_ident
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError

_MOST_WRONG_BITS = 2
_SURE_MARGIN = 100.0
_LEAST_MARGIN = 20.0
"""Grey levels between a tag's bits and their threshold, below which a detection is more often noise than a tag."""
_LEAST_SIDE = 8
"""Pixels of the searched picture: cells of the smallest family with its margin. Below 4 pixels the library crashes."""


@dataclass(frozen=True, eq=False)
class Tag:
    """A tag that was found.

    Attributes:
        id: within its family.
        corners_px: (4, 2) bottom-left, bottom-right, top-right, top-left; pixel centres at integers.
        margin: mean difference between its bits and their threshold, grey levels; larger is clearer.
    """

    id: int
    corners_px: NDArray[np.float64]
    margin: float


_OPENCV_FAMILIES = {"tag36h11": "36h11", "tag25h9": "25h9", "tag16h5": "16h5"}


def detected(grey: NDArray[np.uint8], family: str, decimate: float = 1.0) -> list[Tag]:
    """Every credible tag of a family in a picture (H, W), searched at 1/`decimate` of its size.

    Raises:
        InputError: pupil-apriltags is not installed, and OpenCV does not know the family.
    """
    if min(grey.shape) < _LEAST_SIDE * decimate:
        return []
    if find_spec("pupil_apriltags") is None:
        return detected_by_opencv(grey, family, decimate)
    return [
        Tag(int(tag.tag_id), np.asarray(tag.corners, float) - 0.5, float(tag.decision_margin))
        for tag in detector(family, decimate, get_ident()).detect(np.ascontiguousarray(grey))
        if tag.hamming <= _MOST_WRONG_BITS and tag.decision_margin > _LEAST_MARGIN
    ]


def detected_by_opencv(grey: NDArray[np.uint8], family: str, decimate: float = 1.0) -> list[Tag]:
    """The same by OpenCV's ArUco module, with the AprilTag library's refinement of corners.

    Its tags are turned by half a turn and listed clockwise. It gives no margin; a tag's is that of a sure detection.
    """
    import cv2

    if family not in _OPENCV_FAMILIES:
        known = ", ".join(_OPENCV_FAMILIES)
        raise InputError(f"target.family: '{family}' needs pupil-apriltags; without it there are {known}")
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_APRILTAG
    parameters.aprilTagQuadDecimate = decimate
    code = getattr(cv2.aruco, f"DICT_APRILTAG_{_OPENCV_FAMILIES[family]}")
    search = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(code), parameters)
    corners, ids, _ = search.detectMarkers(np.ascontiguousarray(grey))
    if ids is None:
        return []
    found = zip(np.ravel(ids).tolist(), corners, strict=True)
    return [
        Tag(tag_id, np.roll(np.asarray(quad[0], float)[::-1], 2, 0) - 0.5, _SURE_MARGIN)
        for tag_id, quad in found
    ]


@cache
def detector(family: str, decimate: float, thread: int) -> Any:
    """A thread's own detector, which no two of them can use at once. It lives until the process ends, never freed.

    The library's own destructor frees the tag family before the detector that still uses it, which corrupts the heap.
    """
    from pupil_apriltags import Detector

    class Undying(Detector):  # type: ignore[misc]
        def __del__(self) -> None:
            pass

    return Undying(families=family, nthreads=1, quad_decimate=decimate, refine_edges=1)
