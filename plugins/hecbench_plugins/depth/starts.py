"""Where descents on depth begin: around a start, or from all over a view sphere."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.se3 import Array
from hecbench_plugins.depth.views import FEWEST_VIEWS, DepthViews
from hecbench_plugins.start_search import by_photographs
from hecbench_plugins.start_search.view_sphere import ViewSphere, best_apart

_APART = 0.08
"""Below which two draws are alike: rotation, rad, and shift over the distance."""


def around(views: DepthViews, start: Array, rng: np.random.Generator) -> Iterator[Array]:
    """The best camera_T_parent of draws around a start parent_T_camera, by the mean offset of depth."""
    settings = views.settings
    ball, level, chosen = settings.around, settings.search_level, views.spread(settings.search_views)
    poses = se3.inverse(ball.pose(start, ball.draw(rng, settings.draws)))
    fits = [views.agreement(pose, chosen, level, settings.noise_per_m) for pose in poses]
    least = settings.least_pixels / level**2
    scores = [-fit.cost_m if fit.pixels >= least else -np.inf for fit in fits]
    for index in best_apart(list(poses), scores, settings.followed, _APART):
        if np.isfinite(scores[index]):
            yield poses[index]


def on_a_sphere(views: DepthViews) -> Iterator[Array]:
    """camera_T_parent of a fixed camera anywhere, by where depth came nearer than the background."""
    if len(views) < FEWEST_VIEWS:
        return
    moved, settings = views.moved(1), views.settings
    sphere, coarsest = ViewSphere(spacing_deg=settings.sphere_deg), views.meshes[max(views.meshes)]
    seen = views.K, views.valid, views.parent_T_link, moved
    for pose in by_photographs.starts(coarsest, *seen, sphere, settings.sphere_starts):
        yield _at_measured_distance(views, pose, moved)


def _at_measured_distance(views: DepthViews, camera_T_parent: Array, moved: NDArray[np.float32]) -> Array:
    """The pose moved along the view until the robot is as far off as what moved."""
    measured = np.median(np.concatenate([d[m > 0] for d, m in zip(views.depths, moved, strict=True)]))
    origins = (camera_T_parent @ views.parent_T_link)[..., :3, 3].reshape(-1, 3)
    distance = float(np.median(origins[:, 2]))
    if not np.isfinite(measured) or distance <= 0:
        return camera_T_parent
    scaled = camera_T_parent.copy()
    middle = origins.mean(0)
    scaled[:3, 3] += middle * (measured / distance - 1)
    return scaled
