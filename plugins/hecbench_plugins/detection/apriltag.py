"""The AprilTag of a target in a recording's pictures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError, TargetNotSeen
from hecbench.se3 import Array
from hecbench.system import apriltags
from hecbench.targets import ANY_TAG, AprilTagTarget
from hecbench_plugins.detection.edges import apart
from hecbench_plugins.detection.pictures import each, mirrored
from hecbench_plugins.detection.settings import MARKERS

Grey = NDArray[np.uint8]

FAMILIES = ("tag36h11", "tag25h9", "tag16h5", "tagCircle21h7", "tagStandard41h12")


def tags(grey: Grey, family: str) -> dict[int, Array]:
    """Corners (4, 2) px by tag id, OpenCV's pixel centres; an id seen twice is no one tag's, and is left out.

    Raises:
        InputError: the family is unknown.
    """
    return {tag_id: found[0] for tag_id, found in sightings(grey, family).items() if len(found) == 1}


def sightings(grey: Grey, family: str) -> dict[int, list[Array]]:
    """The corners (4, 2) px of every tag, by id: several where an id is seen more than once.

    Raises:
        InputError: the family is unknown.
    """
    if family not in FAMILIES:
        raise InputError(f"target.family: '{family}' is not one of {', '.join(FAMILIES)}")
    for decimate in (1.0, 2.0):
        if found := apriltags.detected(grey, family, decimate):
            break
    by_id: dict[int, list[Array]] = {}
    for tag in sorted(found, key=lambda tag: -tag.margin):
        others = by_id.setdefault(tag.id, [])
        if all(apart(tag.corners_px, other) for other in others):
            others.append(tag.corners_px)
    return by_id


def find(greys: Sequence[Grey | None], target: AprilTagTarget) -> tuple[AprilTagTarget, list[Array | None]]:
    """The tag's corners in each picture; a target of id `ANY_TAG` becomes the only tag in view.

    A picture that shows the id twice shows no one tag, and counts as one that does not show it.

    Raises:
        TargetNotSeen: the tag is in no picture or mostly twice, or `ANY_TAG` does not single one out; the ids seen are
            listed.
    """
    seen = [found or {} for found in each(greys, sightings, target.family)]
    counts = Counter(tag_id for found in seen for tag_id in found)
    tag_id = target.id
    if tag_id == ANY_TAG and len(counts) == 1:
        tag_id = next(iter(counts))
    if tag_id not in counts:
        ids = ", ".join(f"{number} ({count}x)" for number, count in counts.most_common(8)) or "none"
        wanted = "one tag only" if tag_id == ANY_TAG else f"id {tag_id}"
        cure = "correct it" if counts else f"correct it{mirrored(greys, tags, target.family)}"
        raise TargetNotSeen(
            f"target.id: expected {wanted} of {target.family} in {len(greys)} images, seen: {ids}; {cure}"
        )
    twice = sum(len(found.get(tag_id, ())) > 1 for found in seen)
    if twice > MARKERS.mostly * counts[tag_id]:
        raise TargetNotSeen(
            f"target.id: id {tag_id} of {target.family} is seen twice in {twice} of {counts[tag_id]} images: which of "
            "the two is the target cannot be known; cover one, or print another id"
        )
    resolved = AprilTagTarget(target.family, tag_id, target.size_m)
    return resolved, [found[tag_id][0] if len(found.get(tag_id, ())) == 1 else None for found in seen]
