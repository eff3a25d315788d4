"""The losses that look at every pixel, as functions that torch differentiates; outside its box a drawing is background.

Each is one pass of compiled code over the box: torch's own operators would write and read it several times.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from hecbench_plugins.first_order import kernels
from hecbench_plugins.first_order.drawing import BoxSum, Drawer

Picture = NDArray[np.float32]


class _SquaredError(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, picture: Tensor, reference: Picture, x0: int, y0: int, ceiling: np.float32
    ) -> Tensor:
        ctx.slope = np.empty(picture.shape, np.float32)
        total = kernels.squared_error(picture.numpy(), reference, x0, y0, ceiling, ctx.slope)
        return torch.tensor(total, dtype=torch.float64)

    @staticmethod
    def backward(ctx: Any, *factors: Tensor) -> tuple[Tensor | None, ...]:
        ctx.slope *= np.float32(factors[0].item())
        return torch.from_numpy(ctx.slope), None, None, None, None


class SquaredError:
    """Sum over all pixels of the squared difference between a drawer's first channels and a reference (D, H, W).

    The background is 0 in these channels. Drawn values above `ceiling` count as it, and have no slope.
    """

    def __init__(self, reference: Picture, drawer: Drawer, ceiling: float = np.inf) -> None:
        self._reference, self._drawer, self._ceiling = (
            np.ascontiguousarray(reference),
            drawer,
            np.float32(ceiling),
        )
        self._squares = BoxSum((self._reference.astype(float) ** 2).sum(0))

    def __call__(self, picture: Tensor) -> Tensor:
        box = self._drawer.box
        x0, y0 = (box.x0, box.y0) if box else (0, 0)
        inside: Tensor = _SquaredError.apply(picture, self._reference, x0, y0, self._ceiling)  # type: ignore[no-untyped-call]
        return inside + self._squares.outside(box)


class _Geometry(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, picture: Tensor, channel: int, x0: float, y0: float) -> Tensor:
        ctx.at = picture.numpy(), channel, x0, y0
        sums = np.empty(4)
        kernels.geometry(picture.numpy()[channel], x0, y0, sums)
        return torch.from_numpy(sums)

    @staticmethod
    def backward(ctx: Any, *by_sums: Tensor) -> tuple[Tensor | None, ...]:
        picture, channel, x0, y0 = ctx.at
        slope = np.zeros_like(picture)
        kernels.geometry_slope(picture[channel], x0, y0, by_sums[0].numpy(), slope[channel])
        return torch.from_numpy(slope), None, None, None


def geometry(picture: Tensor, channel: int, drawer: Drawer) -> Tensor:
    """Softmax centroid (x, y) px from the picture's middle and sigmoid area px of one channel, (3,).

    The area is the one beyond an empty picture's, in which every pixel counts one half.
    """
    box = drawer.box
    left, top = _corner(drawer.width, drawer.height)
    x0, y0 = (box.x0 + left, box.y0 + top) if box else (left, top)
    sums: Tensor = _Geometry.apply(picture, channel, x0, y0)  # type: ignore[no-untyped-call]
    return _centroid_and_area(sums, drawer.width * drawer.height)


def geometry_of(mask: Picture) -> Tensor:
    """The same of a whole mask (H, W)."""
    sums = np.empty(4)
    height, width = mask.shape
    kernels.geometry(np.ascontiguousarray(mask), *_corner(width, height), sums)
    return _centroid_and_area(torch.from_numpy(sums), mask.size)


def _corner(width: int, height: int) -> tuple[float, float]:
    """The first pixel from the picture's middle."""
    return -(width - 1) / 2, -(height - 1) / 2


def _centroid_and_area(sums: Tensor, pixels: int) -> Tensor:
    return torch.cat([sums[1:3] / (sums[0] + pixels), sums[3:]])
