"""The network: the encoder of the perception network, told of the posture, and dense layers to nine numbers."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from hecbench_plugins.perception.network import WIDTHS, Encoder
from hecbench_plugins.perception.plan import STRIDE
from hecbench_plugins.regression.answer import NUMBERS
from hecbench_plugins.regression.plan import CROP_PX

_POSTURE_WIDTH, _SQUEEZED, _DENSE = 64, 48, 256
_CELLS = CROP_PX // STRIDE
"""Of the last features, along each side."""
_FIRST_SCALE = 0.1


class RegressionNet(Encoder):
    """Pictures (B, 3, S, S) RGB in [0, 1] and postures (B, P) to numbers (B, 9); see `answer`.

    The posture shifts and scales the features before the last block (Perez et al. 2018, "FiLM"), and joins them in
    the dense layers.
    """

    def __init__(self, posture: int) -> None:
        super().__init__()
        self.posture = nn.Sequential(nn.Linear(posture, _POSTURE_WIDTH), nn.ReLU())
        self.film = nn.Linear(_POSTURE_WIDTH, 2 * WIDTHS[-2])
        self.squeeze = nn.Conv2d(WIDTHS[-1], _SQUEEZED, 1)
        self.dense = nn.Sequential(
            nn.Linear(_SQUEEZED * _CELLS**2 + _POSTURE_WIDTH, _DENSE),
            nn.ReLU(),
            nn.Linear(_DENSE, _DENSE),
            nn.ReLU(),
            nn.Linear(_DENSE, NUMBERS),
        )
        nn.init.zeros_(self.film.weight)
        nn.init.zeros_(self.film.bias)
        last = self.dense[-1]
        assert isinstance(last, nn.Linear)
        with torch.no_grad():
            last.weight.mul_(_FIRST_SCALE)
            last.bias.copy_(torch.tensor([0.0, 0, 0, 1, 0, 0, 0, 0, -1]))

    def forward(self, image: Tensor, posture: Tensor) -> Tensor:
        """The nine numbers."""
        x = self.look(image)
        for block in self.down[:-1]:
            x = block(x)
        known = self.posture(posture)
        scale, shift = self.film(known)[:, :, None, None].chunk(2, 1)
        x = self.down[-1](x * (1 + scale) + shift)
        x = F.relu(self.squeeze(x)).flatten(1)
        out: Tensor = self.dense(torch.cat([x, known], 1))
        return out
