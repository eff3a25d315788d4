"""The AprilTag of a target in a recording's pictures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hecbench import apriltags
from hecbench.errors import InputError, TargetNotSeen
from hecbench.targets import ANY_TAG, AprilTagTarget
from hecbench_plugins.detection.pictures import each

Array = NDArray[np.float64]
Grey = NDArray[np.uint8]

FAMILIES = ("tag36h11", "tag25h9", "tag16h5", "tagCircle21h7", "tagStandard41h12")


def tags(grey: Grey, family: str) -> dict[int, Array]:
    """Corners (4, 2) px by tag id, OpenCV's pixel centres; of tags seen twice the clearer one.

    Raises:
        InputError: the family is unknown.
    """
    if family not in FAMILIES:
        raise InputError(f"target.family: '{family}' is not one of {', '.join(FAMILIES)}")
    for decimate in (1.0, 2.0):
        found = apriltags.detected(grey, family, decimate)
        if found:
            break
    found.sort(key=lambda tag: tag.margin)
    return {tag.id: tag.corners_px for tag in found}


def find(greys: Sequence[Grey | None], target: AprilTagTarget) -> tuple[AprilTagTarget, list[Array | None]]:
    """The tag's corners in each picture; a target of id `ANY_TAG` becomes the only tag in view.

    Raises:
        TargetNotSeen: the tag is in no picture, or `ANY_TAG` does not single one out; the ids seen are listed.
    """
    seen = [found or {} for found in each(greys, tags, target.family)]
    counts = Counter(tag_id for found in seen for tag_id in found)
    tag_id = target.id
    if tag_id == ANY_TAG and len(counts) == 1:
        tag_id = next(iter(counts))
    if tag_id not in counts:
        ids = ", ".join(f"{number} ({count}x)" for number, count in counts.most_common(8)) or "none"
        wanted = "one tag only" if tag_id == ANY_TAG else f"id {tag_id}"
        raise TargetNotSeen(
            f"target.id: expected {wanted} of {target.family} in {len(greys)} images, seen: {ids}; correct it"
        )
    resolved = AprilTagTarget(target.family, tag_id, target.size_m)
    return resolved, [found.get(tag_id) for found in seen]
