"""The settings of a training run of the regression."""

from __future__ import annotations

from dataclasses import dataclass

from hecbench.errors import InputError
from hecbench_plugins.perception import plan

CROP_PX = 128
"""Side of the picture that the network takes."""
SHARE = (0.35, 1.15)
"""Of the crop's side that the robot takes, on a logarithmic scale: less in a whole picture, more where it leaves it."""
ASIDE, ROLL_RAD = 0.1, 0.2
"""Standard deviations of where the robot's middle is, as a share of the side, and of the virtual camera's roll."""


@dataclass(frozen=True)
class Plan(plan.Plan):
    """Settings of a run; for those not named here see `perception.plan.Plan`.

    Attributes:
        size: px of the drawn pictures, from which crops of `CROP_PX` are taken.
        capacity: pictures that are kept: so few that a run which goes on draws them again.
        sketches: steps of the dense layers before any picture is drawn; see `sketches`.
        start_from: a checkpoint of this training, or the folder of a perception model whose convolutions are the start.
    """

    size: int = 160
    batch: int = 16
    rate: float = 3e-4
    pictures_per_step: int = 2
    capacity: int = 512
    sketches: int = 7_000

    def check(self) -> None:
        """Refuse what cannot be run.

        Raises:
            InputError: naming the option and the cure.
        """
        super().check()
        if len(self.robots) != 1:
            raise InputError(f"--robot: this network is for one robot, {len(self.robots)} are given")
        if self.sketches < 0:
            raise InputError(f"--sketches must be 0 or more, is {self.sketches}")
