"""Where descents on depth begin: around a start, or from all over a view sphere."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hecbench import se3
from hecbench.samples.spread import evenly
from hecbench.se3 import Array
from hecbench_plugins.depth.views import FEWEST_VIEWS, DepthViews
from hecbench_plugins.start_search import by_photographs
from hecbench_plugins.start_search.view_sphere import ViewSphere, best_apart

_APART = 0.08
"""Below which two draws are alike: rotation, rad, and shift over the distance."""


def around(views: DepthViews, start: Array, rng: np.random.Generator) -> Iterator[Array]:
    """The best camera_T_parent of draws around a start parent_T_camera, by the mean offset of depth."""
    settings = views.settings
    ball, level = settings.around, settings.search_level
    chosen = evenly(len(views), settings.search_views).tolist()
    poses = se3.inverse(ball.pose(start, ball.draw(rng, settings.draws)))
    costs_m, pixels = views.costs(poses, chosen, level)
    scores = np.where(pixels >= settings.least_pixels / level**2, -costs_m, -np.inf)
    for index in best_apart(list(poses), scores.tolist(), settings.followed, _APART):
        if np.isfinite(scores[index]):
            yield poses[index]


def on_a_sphere(views: DepthViews) -> Iterator[Array]:
    """camera_T_parent of a fixed camera anywhere, by where depth came nearer than the background."""
    if len(views) < FEWEST_VIEWS:
        return
    moved, settings = views.moved(1), views.settings
    near = np.concatenate([depth[there > 0] for depth, there in zip(views.depths, moved, strict=True)])
    if not near.size:
        return
    sphere, coarsest = ViewSphere(spacing_deg=settings.sphere_deg), views.meshes[max(views.meshes)]
    seen = views.K, views.valid, views.parent_T_link, moved
    yield from by_photographs.starts(
        (coarsest, coarsest), *seen, sphere, settings.sphere_starts, [float(np.median(near))]
    )
