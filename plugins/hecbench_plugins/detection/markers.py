"""Single square markers, grids of them and AprilGrids: found by OpenCV, their corners refined along the edges.

Markers: Garrido-Jurado et al. 2014, "Automatic generation and detection of highly reliable fiducial markers under
occlusion". Kalibr's grids have a black border of two cells and black squares between the tags, which hide the tags'
outlines: they are parted by widening the white. How the markers are turned in their places (Kalibr's AprilTags stand
upside down against OpenCV's) follows from the pictures.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import TargetNotSeen
from hecbench.se3 import Array
from hecbench.targets import AprilGridTarget, ArucoGridTarget, ArucoTarget, MarkersTarget
from hecbench_plugins.detection.dictionaries import named, shown_in
from hecbench_plugins.detection.edges import apart, refined
from hecbench_plugins.detection.pictures import each, mirrored
from hecbench_plugins.detection.settings import MARKERS

Grey = NDArray[np.uint8]
Sightings = list[dict[int, Array]]


@dataclass(frozen=True)
class Layout:
    """A way to read the markers: the target's numbers, and quarter turns of each marker in its place."""

    target: MarkersTarget
    turns: int


def find(greys: Sequence[Grey | None], target: MarkersTarget) -> tuple[MarkersTarget, list[Array | None]]:
    """The target with the first id that the pictures show, and corners (P, 2) px of each.

    Raises:
        InputError: the dictionary is unknown.
        TargetNotSeen: no picture shows it; the message says what they show instead.
    """
    seen = _sightings(greys, target.dictionary)
    ids = sorted({number for found in seen for number in found})
    if not ids:
        raise TargetNotSeen(f"target: no image shows a marker; {_cause(greys, target)}")
    for layout in _layouts(target, ids):
        kept = [_placed(found, layout) for found in seen]
        shown = sum(map(len, kept))
        wanted = sum(number in _range(layout.target) for found in seen for number in found)
        if shown and shown >= MARKERS.well_placed * wanted:
            return layout.target, [_corners(found, layout) for found in kept]
    raise TargetNotSeen(f"target: no image shows the {target.kind}; {_other_layout(seen, ids, target)}")


def _layouts(target: MarkersTarget, ids: list[int]) -> Iterator[Layout]:
    """The declared one in every turn of its markers, then with the first id that is seen."""
    turns = (0,) if target.marker_count == 1 else (0, 2, 1, 3)
    yield from (Layout(target, turn) for turn in turns)
    if ids[0] != target.first_id and isinstance(target, ArucoGridTarget | AprilGridTarget):
        yield from (Layout(replace(target, first_id=ids[0]), turn) for turn in turns)


def _range(target: MarkersTarget) -> range:
    return range(target.first_id, target.first_id + target.marker_count)


def _sightings(greys: Sequence[Grey | None], dictionary: str) -> Sightings:
    """Corners (4, 2) px by id of every picture, read with the border that shows more markers."""
    named(dictionary)
    ways = [[found or {} for found in each(greys, markers, dictionary, border)] for border in MARKERS.borders]
    return max(ways, key=lambda way: sum(map(len, way)))


def markers(grey: Grey, dictionary: str, border: int) -> dict[int, Array]:
    """Corners (4, 2) px by id, from the marker's top-left clockwise; an id seen twice is no one marker's."""
    import cv2

    parameters = cv2.aruco.DetectorParameters()
    parameters.markerBorderBits = border
    known = named(dictionary)
    detector, cells = cv2.aruco.ArucoDetector(known, parameters), known.markerSize + 2 * border
    by_id: dict[int, list[Array]] = {}
    for width in MARKERS.widenings_px:
        picture = np.asarray(cv2.dilate(grey, np.ones((width, width), np.uint8)), np.uint8)
        quads, ids, _ = detector.detectMarkers(picture)
        for number, quad in zip([] if ids is None else np.ravel(ids).tolist(), quads, strict=True):
            corners = refined(grey, np.asarray(quad[0], float), cells)
            others = by_id.setdefault(int(number), [])
            if corners is not None and all(apart(corners, other) for other in others):
                others.append(corners)
    return {number: found[0] for number, found in by_id.items() if len(found) == 1}


def _side(corners: Array) -> float:
    return float(np.linalg.norm(np.roll(corners, 1, 0) - corners, axis=1).mean())


def _listed(corners: Array, layout: Layout) -> Array:
    """A marker's corners in the order of the target's points."""
    turned = np.roll(corners, -layout.turns, 0)
    if isinstance(layout.target, AprilGridTarget):  # counter-clockwise, from the bottom left
        turned = np.roll(turned[::-1], 1, 0)
    return turned


def _points(layout: Layout, number: int) -> Array:
    first = 4 * (number - layout.target.first_id)
    return layout.target.points_m[first : first + 4, :2]


def _placed(found: dict[int, Array], layout: Layout) -> dict[int, Array]:
    """The markers of a picture that lie where the layout has them, by one homography."""
    import cv2

    ours = {number: corners for number, corners in found.items() if number in _range(layout.target)}
    if len(ours) < 2:
        return ours if layout.target.marker_count == 1 else {}
    plane = np.concatenate([_points(layout, number) for number in ours])
    pixels = np.concatenate([_listed(corners, layout) for corners in ours.values()])
    limits = {number: MARKERS.placed * _side(corners) for number, corners in ours.items()}
    H, _ = cv2.findHomography(plane, pixels, cv2.RANSAC, float(np.median(list(limits.values()))))
    if H is None:
        return {}
    mapped = np.c_[plane, np.ones(len(plane))] @ np.asarray(H).T
    off = np.linalg.norm(mapped[:, :2] / mapped[:, 2:] - pixels, axis=1).reshape(-1, 4).max(1)
    kept = [number for number, distance in zip(ours, off, strict=True) if distance < limits[number]]
    return {number: ours[number] for number in kept} if len(kept) > 1 else {}


def _corners(found: dict[int, Array], layout: Layout) -> Array | None:
    if not found:
        return None
    corners = np.full((len(layout.target.points_m), 2), np.nan)
    for number, quad in found.items():
        first = 4 * (number - layout.target.first_id)
        corners[first : first + 4] = _listed(quad, layout)
    return corners


def _cause(greys: Sequence[Grey | None], target: MarkersTarget) -> str:
    if note := mirrored(greys, markers, target.dictionary, MARKERS.borders[0]):
        return note.removeprefix("; ")
    return shown_in(greys, target.dictionary)


def _other_layout(seen: Sightings, ids: list[int], target: MarkersTarget) -> str:
    """What the pictures show that the target is not."""
    shown = f"{len(ids)} ids from {ids[0]} to {ids[-1]} are seen"
    if isinstance(target, ArucoTarget):
        return f"{shown}, not {target.id}: correct target.id"
    if not isinstance(target, ArucoGridTarget | AprilGridTarget):
        return shown
    for columns in range(1, len(ids) + 1):
        rows = -(-(ids[-1] - ids[0] + 1) // columns)
        other = replace(target, columns=columns, rows=rows, first_id=ids[0])
        for turn in range(4):
            placed = [_placed(found, Layout(other, turn)) for found in seen]
            if sum(map(len, placed)) >= MARKERS.well_placed * sum(map(len, seen)):
                return (
                    f"{shown}, as a grid of {columns} columns, not {target.columns}: count columns and rows"
                )
    white = "spacing" if isinstance(target, AprilGridTarget) else "gap_m"
    return f"{shown}, but not in the declared places: measure target.{white}; is the board flat?"
