"""The settings of the solver `regression`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

SHIPPED = Path(__file__).parents[1] / "networks" / "weights_regression_ur5e"
"""The network that comes with this package; its card is in there."""


@dataclass(frozen=True)
class Settings:
    """What decides an answer.

    Attributes:
        model: the folder of a trained network.
        largest_blur: mean spread of the keypoints' heatmaps, a share of the side, above which a picture shows no
            robot. Chosen on 60 drawn pictures: it leaves out an even grey, nearly half of the crowded ones without a
            robot, and the darkest or most hidden eighth of those with one.
        largest_spread_rad: of the rotation that one view answers, about one axis, above which the views contradict
            each other; recordings of the virtual lab have 0.03 to 0.12.
    """

    model: Path = SHIPPED
    largest_blur: float = 0.2
    largest_spread_rad: float = 0.6
