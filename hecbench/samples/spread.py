"""A few samples that stand for all of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def evenly(count: int, most: int) -> NDArray[np.intp]:
    """Indices of at most so many of `count`, evenly spread from the first to the last; of few, all."""
    return np.linspace(0, count - 1, min(count, most)).round().astype(np.intp)
