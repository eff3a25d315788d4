"""Adam (Kingma and Ba 2015) on six numbers, in two groups of which one may pause.

Plain numpy: torch's own costs more than ten times as much on so few numbers, which counts beside a renderer of 2 ms.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hecbench.se3 import Array

_BETAS, _EPSILON = (0.9, 0.999), 1e-8
"""The defaults of the publication."""


@dataclass
class Adam:
    """One group of numbers, with the weight decay added to the slope as torch.optim.Adam does."""

    values: Array
    rate: float
    weight_decay: float = 0.0
    _steps: int = 0
    _mean: Array = field(init=False)
    _square: Array = field(init=False)

    def __post_init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Forget the moments."""
        self._steps, self._mean, self._square = 0, np.zeros_like(self.values), np.zeros_like(self.values)

    def step(self, slope: Array) -> None:
        """Move the values, in their place, against the slope."""
        slope = slope + self.weight_decay * self.values
        self._steps += 1
        first, second = _BETAS
        self._mean += (1 - first) * (slope - self._mean)
        self._square += (1 - second) * (slope * slope - self._square)
        size = np.sqrt(self._square / (1 - second**self._steps)) + _EPSILON
        self.values -= self.rate / (1 - first**self._steps) * self._mean / size
