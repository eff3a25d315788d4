"""The settings of a training run of the regression."""

from __future__ import annotations

from dataclasses import dataclass

from hecbench.errors import InputError
from hecbench_plugins.perception import plan

CROP_PX = 128
"""Side of the picture that the network takes."""


@dataclass(frozen=True)
class Plan(plan.Plan):
    """Settings of a run; see `perception.plan.Plan`.

    Attributes:
        size: px of the drawn pictures, from which crops of `CROP_PX` are taken.
        capacity: pictures that are kept: so few that a run which goes on draws them again.
        start_from: a checkpoint of this training, or the folder of a perception model whose encoder is the start.
    """

    size: int = 160
    batch: int = 24
    rate: float = 5e-4
    pictures_per_step: int = 2
    capacity: int = 512

    def check(self) -> None:
        """Refuse what cannot be run.

        Raises:
            InputError: naming the option and the cure.
        """
        super().check()
        if len(self.robots) != 1:
            raise InputError(f"--robot: this network is for one robot, {len(self.robots)} are given")
