"""Masks of the views as a target: what a drawn mask costs within its box, and all that lies outside."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import mse_loss

from hecbench.recording import Recording
from hecbench_plugins.first_order.backend import Backend, drawer
from hecbench_plugins.first_order.drawing import (
    MASK,
    BoxSum,
    Drawer,
    link_mask_meshes,
    robot_name,
    whole_mask_mesh,
)
from hecbench_plugins.render_views import Picture, View

MaskMode = Literal["zbuffered", "per_link"]


def mask_drawers(
    recording: Recording, views: Sequence[View], mode: MaskMode, backend: Backend
) -> list[Drawer]:
    """Drawers of the robot's mask: one z-buffered picture, or the links' masks added up."""
    name = robot_name(recording)
    meshes = (whole_mask_mesh(name),) if mode == "zbuffered" else link_mask_meshes(name)
    return [drawer(backend, meshes, MASK, view) for view in views]


class MaskTarget:
    """The mask of one view."""

    def __init__(self, view: View, drawer: Drawer) -> None:
        self.mask: Picture = view.levels[1].observed[..., 3]
        self._drawer = drawer
        self._tensor = torch.from_numpy(np.ascontiguousarray(self.mask))
        self._squares = BoxSum(self.mask.astype(float) ** 2)
        self.pixels = float(self.mask.sum(dtype=float))

    def squared_error(self, drawn: Tensor) -> Tensor:
        """Sum over all pixels of (drawn - mask)^2 for a drawn mask (h, w) of the drawer's box."""
        box = self._drawer.box
        if box is None:
            return drawn.sum() + self._squares.total
        inside = mse_loss(drawn, self._tensor[box.slices], reduction="sum")
        return inside + self._squares.outside(box)
