"""EasyHeC and the optimisation of EasyHeC++: the robot's mask by Adam on the se(3) logarithm of the pose.

Chen et al. 2023, "EasyHeC: Accurate and automatic hand-eye calibration via differentiable rendering and space
exploration", RA-L 8(11); Zheng et al. 2024, "EasyHeC++", IROS. Per view the sum over pixels of (S - S_ref)^2,
averaged over views; Adam, the last iterate. Rate, decay and steps are those of the authors' code.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from torch import Tensor

from hecbench import se3
from hecbench.errors import Refusal
from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.se3 import Array
from hecbench_plugins.first_order.backend import Backend
from hecbench_plugins.first_order.descent import AdamSettings, Verdict, descend, to_estimate
from hecbench_plugins.first_order.hemisphere import Hemisphere, best_on_hemisphere
from hecbench_plugins.first_order.losses import SquaredError
from hecbench_plugins.first_order.masks import MaskMode, mask_drawers, mask_of
from hecbench_plugins.first_order.poses import LogVector
from hecbench_plugins.views.pyramid import prepare


@dataclass(frozen=True)
class EasyHeC:
    """The options of the method.

    Attributes:
        masks: `per_link` draws every link alone, adds the masks and clamps them at 1, as the authors' code does;
            `zbuffered` draws the whole robot at once. Both differ along contours between links only.
        iterations: of Adam.
        backend: which renderer draws.
        search_start: begin with the best mask overlap on a hemisphere instead of the recording's start (EasyHeC++).
        rate, weight_decay: of Adam, advanced.
        hemisphere: of the searched start, advanced.
    """

    masks: MaskMode = "per_link"
    iterations: int = 1000
    backend: Backend = "cpu"
    search_start: bool = False
    rate: float = 3e-3
    weight_decay: float = 5e-4
    hemisphere: Hemisphere = field(default_factory=Hemisphere)

    def __call__(self, recording: Recording, *, rng: np.random.Generator) -> Estimate:
        """Calibrate from the recording's start, or from a searched one."""
        robot, views = prepare(recording)
        details: dict[str, Any] = {"masks": self.masks}
        if self.search_start:
            found = best_on_hemisphere(recording, views, self.hemisphere)
            start = found.camera_T_parent
            details |= {"start_overlap": found.overlap, "start_candidates": found.candidates}
        elif recording.initial_parent_T_camera is None:
            raise Refusal(
                "easyhec needs a start: initial_parent_T_camera, or --init FILE; easyhecpp needs none"
            )
        else:
            robot.check_start(recording)
            start = se3.inverse(recording.initial_parent_T_camera)
        drawers = mask_drawers(robot.model, views, self.masks, self.backend)
        ceiling = 1.0 if self.masks == "per_link" else np.inf
        errors = [
            SquaredError(mask_of(view)[None], drawer, ceiling)
            for view, drawer in zip(views, drawers, strict=True)
        ]

        def objective(pictures: Sequence[Tensor], camera_T_parent: Array) -> Verdict:
            losses = [error(picture) for error, picture in zip(errors, pictures, strict=True)]
            return Verdict(sum(losses[1:], start=losses[0]) / len(losses), "masks")

        settings = AdamSettings(self.iterations, self.rate, self.weight_decay)
        run = descend(drawers, LogVector(start), objective, settings)
        return to_estimate(run, views, drawers, run.last, details)
