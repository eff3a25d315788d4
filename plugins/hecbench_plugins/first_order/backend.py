"""Which renderer draws for the first-order methods."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from hecbench.rendering import RenderMesh
from hecbench_plugins.first_order.drawing import CpuDrawer, Drawer
from hecbench_plugins.views.pyramid import Picture, View

Backend = Literal["cpu", "nvdiffrast"]


def drawer(backend: Backend, meshes: Sequence[RenderMesh], colours: Picture, view: View) -> Drawer:
    """The drawer of one view, at full size.

    Raises:
        Refusal: nvdiffrast or a GPU is missing.
    """
    renderer = view.levels[1].renderer
    K, width, height = np.asarray(renderer.K, float), renderer.width, renderer.height
    if backend == "nvdiffrast":
        from hecbench_plugins.first_order.nvdiffrast_backend import NvdiffrastDrawer

        return NvdiffrastDrawer(meshes, colours, view, K, width, height)
    return CpuDrawer(meshes, colours, view, K, width, height)
