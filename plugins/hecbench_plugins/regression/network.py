"""The network: convolutions to where the robot's keypoints may be, and dense layers from there to nine numbers."""

from __future__ import annotations

from itertools import pairwise

import torch
from torch import Tensor, nn

from hecbench_plugins.perception.network import PerceptionNet
from hecbench_plugins.regression.answer import NUMBERS
from hecbench_plugins.regression.plan import CROP_PX

_WIDTH = 384
"""Of the dense layers."""
_LEAST_VARIANCE = 1e-6
"""Of a keypoint's place, as a share of the side, squared."""


class Dense(nn.Module):
    """Places (B, 3 K) of keypoints and postures (B, P) to numbers (B, 9); see `answer`."""

    def __init__(self, keypoints: int, posture: int) -> None:
        super().__init__()
        widths = (3 * keypoints + posture, _WIDTH, _WIDTH, _WIDTH)
        layers = [nn.Sequential(nn.Linear(a, b), nn.ReLU()) for a, b in pairwise(widths)]
        self.layers = nn.Sequential(*layers, nn.Linear(_WIDTH, NUMBERS))

    def forward(self, places: Tensor, posture: Tensor) -> Tensor:
        """The nine numbers."""
        out: Tensor = self.layers(torch.cat([places, posture], 1))
        return out


class RegressionNet(PerceptionNet):
    """Pictures (B, 3, S, S) RGB in [0, 1] and postures (B, P) to numbers (B, 10): those of `answer`, and the blur.

    The convolutions are those of the perception network, whose weights may be their start. Between them and the
    dense layers each heatmap becomes its mean place and its spread (spatial softmax, Levine et al. 2016).
    """

    def __init__(self, classes: int, keypoints: int, posture: int) -> None:
        super().__init__(classes, keypoints)
        self.dense = Dense(keypoints, posture)
        self.register_buffer("axis", axis_of(CROP_PX // 2), persistent=False)

    def forward(self, x: Tensor, posture: Tensor) -> Tensor:  # type: ignore[override]
        """Nine numbers for the pose, and the mean spread of the heatmaps, a share of the side."""
        places = self.places(x)
        blur = places[:, 2 * self.keypoints :].mean(1, keepdim=True)
        return torch.cat([self.dense(places, posture), blur], 1)

    def places(self, x: Tensor) -> Tensor:
        """(B, 3 K), as `places_of` has them, in pictures."""
        assert isinstance(self.axis, Tensor)
        return places_of(super().forward(x)[:, self.classes + 1 :].float(), self.axis)


def axis_of(cells: int) -> Tensor:
    """(S, 2): each cell's place from the middle, as a share of the side, and its square."""
    place = (torch.arange(cells) + 0.5) / cells - 0.5
    return torch.stack([place, place**2], 1)


def places_of(heat: Tensor, axis: Tensor) -> Tensor:
    """(B, 3 K): across and down from the middle, then the spread, shares of the side, of heatmaps (B, K, S, S)."""
    share = heat.flatten(2).softmax(2).view(heat.shape)
    across, down = share.sum(2) @ axis, share.sum(3) @ axis
    x, y = across[..., 0], down[..., 0]
    variance = (across[..., 1] + down[..., 1] - x * x - y * y).clamp(min=_LEAST_VARIANCE)
    return torch.cat([x, y, variance.sqrt()], 1)
