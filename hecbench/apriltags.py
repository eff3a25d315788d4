"""AprilTags in a picture by pupil-apriltags.

Detection: Wang and Olson 2016, "AprilTag 2: efficient and robust fiducial detection". The library puts pixel centres at
half integers, ours lie at integers. It orders corners as the recording format does: bottom-left, bottom-right,
top-right, top-left of the official tag.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from threading import get_ident
from typing import Any

import numpy as np
from numpy.typing import NDArray

_MOST_WRONG_BITS = 2
_LEAST_MARGIN = 20.0
"""Grey levels between a tag's bits and their threshold, below which a detection is more often noise than a tag."""


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


def detected(grey: NDArray[np.uint8], family: str, decimate: float = 1.0) -> list[Tag]:
    """Every credible tag of a family in a picture (H, W), searched at 1/`decimate` of its size."""
    return [
        Tag(int(tag.tag_id), np.asarray(tag.corners, float) - 0.5, float(tag.decision_margin))
        for tag in detector(family, decimate, get_ident()).detect(np.ascontiguousarray(grey))
        if tag.hamming <= _MOST_WRONG_BITS and tag.decision_margin > _LEAST_MARGIN
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
