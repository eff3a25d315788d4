"""The network: a small U-Net (Ronneberger et al. 2015) with residual blocks; its answer has half the picture's size."""

from __future__ import annotations

from itertools import pairwise

from torch import Tensor, nn
from torch.nn import functional as F

WIDTHS = (16, 40, 72, 112, 152)
"""Channels at 1/2, 1/4, ... of the picture's size: 1.23 million weights, 0.02 s of one core for 320 x 320 px."""
LAST_WIDTH = 32


class ConvUnit(nn.Sequential):
    """Convolution, normalisation, and ReLU if `active`."""

    def __init__(self, inputs: int, outputs: int, stride: int = 1, active: bool = True) -> None:
        layers: list[nn.Module] = [
            nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False),
            nn.BatchNorm2d(outputs),
        ]
        super().__init__(*layers, *([nn.ReLU(inplace=True)] if active else []))


class Residual(nn.Module):
    """He et al. 2016: two convolutions beside a short cut."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.a, self.b = ConvUnit(width, width), ConvUnit(width, width, active=False)

    def forward(self, x: Tensor) -> Tensor:
        """(B, width, H, W), both ways."""
        return F.relu(x + self.b(self.a(x)))


class PerceptionNet(nn.Module):
    """(B, 3, H, W) RGB in [0, 1] to logits (B, classes + 1 + keypoints, H/2, W/2).

    The first `classes` compete: background and colours of the whole robot. Then the visible robot, and one heatmap
    for each keypoint.
    """

    def __init__(self, classes: int, keypoints: int) -> None:
        super().__init__()
        self.classes, self.keypoints = classes, keypoints
        steps = list(pairwise(WIDTHS))
        self.stem = ConvUnit(3, WIDTHS[0], 2)
        self.down = nn.ModuleList(nn.Sequential(ConvUnit(a, b, 2), Residual(b)) for a, b in steps)
        self.side = nn.ModuleList(nn.Conv2d(b, a, 1) for a, b in steps)
        self.up = nn.ModuleList(ConvUnit(a, a if place else LAST_WIDTH) for place, (a, _) in enumerate(steps))
        self.head = nn.Conv2d(LAST_WIDTH, classes + 1 + keypoints, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Logits of pictures whose sides are multiples of `plan.STRIDE`."""
        levels = [self.stem(x * 4 - 2)]
        for block in self.down:
            levels.append(block(levels[-1]))
        y = levels.pop()
        for side, up in zip(reversed(self.side), reversed(self.up), strict=True):
            y = F.interpolate(side(y), scale_factor=2.0, mode="bilinear", align_corners=False)
            y = up(y + levels.pop())
        out: Tensor = self.head(y)
        return out
