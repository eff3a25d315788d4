"""Masks of the robot, drawn and given."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from hecbench.robots.model import RobotModel
from hecbench_plugins.first_order.backend import Backend, drawer
from hecbench_plugins.first_order.drawing import (
    MASK,
    Drawer,
    link_mask_meshes,
    whole_mask_mesh,
)
from hecbench_plugins.views.pyramid import Picture, View

MaskMode = Literal["zbuffered", "per_link"]


def mask_drawers(model: RobotModel, views: Sequence[View], mode: MaskMode, backend: Backend) -> list[Drawer]:
    """Drawers of the robot's mask: one z-buffered picture, or the links' masks added up."""
    meshes = (whole_mask_mesh(model),) if mode == "zbuffered" else link_mask_meshes(model)
    return [drawer(backend, meshes, MASK, view) for view in views]


def mask_of(view: View) -> Picture:
    """The given mask (H, W) of a view, in [0, 1]."""
    return view.levels[1].observed[..., 3]
