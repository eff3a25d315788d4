"""Whether pictures look as the renderer would draw them, and what of them is given to a translator."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hecbench.se3 import Array
from hecbench_plugins.views.pyramid import Picture, View

_BLACK = 0.02
"""Of full brightness: darker is black, with the noise of a dark sensor."""
_SOFT_EDGE_PX = 2
"""Width of the blur at the robot's edge."""
_OTHER_COLOUR = 0.05
"""Of full brightness: a part that differs more from its model is not as the renderer draws it."""
_FEWEST_PIXELS = 50
"""Of a part whose median colour is compared."""
_GOOD_OVERLAP = 0.8
"""Of drawing and mask; below it the colours are not those of the same parts."""


def on_black(view: View) -> bool:
    """Whether nothing but black is around the robot."""
    return view.uniform_background and float(view.levels[1].background.max()) < _BLACK


def cut_out(view: View) -> tuple[Picture, Picture]:
    """The picture (H, W, 3) and the mask (H, W) that a translator gets.

    Before black the mask is wider by the soft edge of the robot: a mask of half covered pixels would cut that off,
    and with it a quarter of a pixel all around.
    """
    level = view.levels[1]
    mask = level.observed[..., 3]
    if on_black(view):
        import cv2

        mask = cv2.dilate(mask, np.ones((2 * _SOFT_EDGE_PX + 1,) * 2, np.uint8))
        if level.hidden is not None:
            mask = np.where(level.hidden, np.float32(0), mask)
    return view.raw, mask


def why_not_simulated(views: Sequence[View], camera_T_parent: Array) -> str | None:
    """How the pictures differ from the renderer's own; None: they do not.

    Colours are compared only where the drawing at the pose overlaps the mask well.
    """
    if not all(on_black(view) for view in views):
        return "the background is not black"
    off = [_colours_off(view, camera_T_parent) for view in views]
    if max(off) > _OTHER_COLOUR:
        return f"the parts' colours differ from the model's by {max(off):.2f} on average"
    return None


def _colours_off(view: View, camera_T_parent: Array) -> float:
    """Mean difference, over pixels, of the parts' median colours from the model's."""
    level = view.levels[1]
    level.renderer.draw(camera_T_parent @ view.parent_T_link)
    drawn, seen, part = level.drawn(), level.observed[..., 3] > 0.5, level.renderer.part
    if (drawn & seen).sum() < _GOOD_OVERLAP * max((drawn | seen).sum(), 1):
        return 0.0
    labels, values = part[drawn & seen], view.raw[drawn & seen]
    total = count = 0.0
    for k in np.unique(labels).tolist():
        here = labels == k
        if here.sum() >= _FEWEST_PIXELS:
            total += here.sum() * np.abs(np.median(values[here], 0) - level.renderer.mesh.colours[k]).mean()
            count += here.sum()
    return float(total / max(count, 1))
