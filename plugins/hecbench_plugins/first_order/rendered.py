"""The renderer as a function that torch differentiates."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

from hecbench.se3 import Array
from hecbench_plugins.first_order.drawing import Drawer
from hecbench_plugins.first_order.poses import PoseNumbers


class _Render(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, translation: Tensor, rotation: Tensor, drawer: Drawer, numbers: PoseNumbers, pose: Array
    ) -> Tensor:
        ctx.at = drawer, numbers, translation.numpy(), rotation.numpy()
        return torch.from_numpy(drawer.draw(pose))

    @staticmethod
    def backward(ctx: Any, *slopes: Tensor) -> tuple[Tensor | None, ...]:
        drawer, numbers, translation, rotation = ctx.at
        left = drawer.pull(slopes[0].contiguous().numpy())
        by_translation, by_rotation = numbers.pull(translation, rotation, left)
        return torch.from_numpy(by_translation), torch.from_numpy(by_rotation), None, None, None


def rendered(
    translation: Tensor, rotation: Tensor, drawer: Drawer, numbers: PoseNumbers, pose: Array
) -> Tensor:
    """The picture (C, h, w) of `drawer.box` at `pose`, camera_T_parent, the one that the numbers (3,) and (3,),
    float64, stand for; differentiable by them.

    Its derivative is the crossings' (see `hecbench.rendering`), contracted with the slope of the loss when torch
    asks for it. Picture and derivative belong to the drawer and are valid until it draws again.
    """
    picture: Tensor = _Render.apply(translation, rotation, drawer, numbers, pose)  # type: ignore[no-untyped-call]
    return picture
