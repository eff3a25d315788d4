"""The advanced numbers of the searches for a start; `ViewSphere` holds the directions, rolls and distances tried.

Where no source is named, they come from sets that no table reports; see docs/guess-free.md.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class MaskSearchSettings:
    """Of the search by masks.

    Attributes:
        search_px, smallest: longer side of a mask at the size of the search, and the most pixels of the recording in
            one there.
        scanned_views, refined_views: how many views judge all poses, and the refined ones.
        placing_rounds: in which a pose is shifted until the drawing lies on the mask.
        clip_px: distance between the contours from which on it counts less.
        small_step: rad or m below which a refinement has converged.
        first_round, rounds: how many of the best are refined, and in how many steps, round by round; the first by the
            scanned views alone.
        fewest_pixels: of a drawing that can be judged.
    """

    search_px: int = 80
    smallest: int = 8
    scanned_views: int = 2
    refined_views: int = 5
    placing_rounds: int = 3
    clip_px: float = 8.0
    small_step: float = 1e-3
    first_round: tuple[int, int] = (150, 6)
    rounds: tuple[tuple[int, int], ...] = ((24, 12), (12, 12))
    fewest_pixels: int = 8


@dataclass(frozen=True)
class PhotographSearchSettings:
    """Of the search by what changed between photographs.

    Attributes:
        distances: of the camera, in spans of the moving links.
        coarse_cell_m: of the mesh of the coarse drawings.
        coarse_px, width_px: width of the drawings: of all poses, then of the better ones.
        batch: poses whose drawings are correlated at once.
        better: share of the poses that the coarse drawings leave. On 16 sets of 5 to 40 photographs, real and rendered,
            the six best starts of the fine drawings were all among the first 0.008.
        views: photographs that are compared.
        unchanged_cost: of covering a pixel that did not change, over what a changed one earns.
        apart: below which two starts are alike, see `best_apart`.
    """

    distances: tuple[float, ...] = (1.2, 1.6, 2.1, 2.8, 3.7, 4.9)
    coarse_cell_m: float = 0.04
    coarse_px: int = 40
    width_px: int = 80
    batch: int = 16
    better: float = 0.05
    views: int = 5
    unchanged_cost: float = 0.7
    apart: float = 0.2


MASKS, PHOTOGRAPHS = MaskSearchSettings(), PhotographSearchSettings()
