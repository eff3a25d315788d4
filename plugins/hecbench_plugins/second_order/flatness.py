"""Whether pictures are what the comparison of colours takes them for: flat parts and background, drawn edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hecbench_plugins.second_order.photometry import Photometry
from hecbench_plugins.second_order.settings import STAGES


def unevenness(photometry: Photometry) -> float:
    """Standard deviation, in [0, 1], of what is left of shading in parts or background at the pictures drawn last.

    Residuals inside a region, away from every edge, are noise where the region is flat; what they share with those
    `STAGES.uneven_apart_px` beside them is shading, texture or mottling. The largest value over views and both regions.
    """
    worst = 0.0
    for view, residual in zip(photometry.views, photometry.residuals, strict=True):
        at = view.levels[photometry.level]
        box = photometry.box(at)
        area = (slice(box[2], box[3] + 1), slice(box[0], box[1] + 1))
        part = at.renderer.part[area]
        inner = _inner(part)
        if at.hidden is not None:
            inner &= ~at.hidden[area]
        for region in (inner & (part < 0), inner & (part >= 0)):
            worst = max(worst, _shared(residual, region))
    return float(np.sqrt(worst))


def edge_excess(photometry: Photometry) -> float:
    """How much larger the residuals of the pictures drawn last are beside edges than inside parts, rms in [0, 1].

    A camera averages over its pixels, where a drawn edge is straight: that shows beside edges alone.
    """
    beside, inside = [np.zeros(0, np.float32)], [np.zeros(0, np.float32)]
    for view, residual in zip(photometry.views, photometry.residuals, strict=True):
        at = view.levels[photometry.level]
        box = photometry.box(at)
        part = at.renderer.part[box[2] : box[3] + 1, box[0] : box[1] + 1]
        inner = _inner(part)
        beside.append((residual[~inner] ** 2).ravel())
        inside.append((residual[inner & (part >= 0)] ** 2).ravel())
    edges, parts = np.concatenate(beside), np.concatenate(inside)
    more = (edges.mean() if len(edges) else 0.0) - (parts.mean() if len(parts) else 0.0)
    return float(np.sqrt(max(more, 0.0)))


def _inner(part: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Pixels (h, w) in whose neighbourhood only one part is drawn."""
    from scipy import ndimage

    width = 2 * STAGES.uneven_apart_px + 1
    return np.asarray(ndimage.maximum_filter(part, width) == ndimage.minimum_filter(part, width))


def _shared(residual: NDArray[np.float32], region: NDArray[np.bool_]) -> float:
    """The variance that pixels of a region share with those beside them, less what noise may feign."""
    if not region.any():
        return 0.0
    centred = residual - residual[region].mean(0)
    worst = 0.0
    for one, other in (
        (
            (slice(None), slice(STAGES.uneven_apart_px, None)),
            (slice(None), slice(None, -STAGES.uneven_apart_px)),
        ),
        ((slice(STAGES.uneven_apart_px, None),), (slice(None, -STAGES.uneven_apart_px),)),
    ):
        both = region[one] & region[other]
        if not both.any():
            continue
        products = (centred[one] * centred[other])[both].mean(-1)
        worst = max(
            worst, float(products.mean() - STAGES.uneven_sure * products.std() / np.sqrt(len(products)))
        )
    return worst
