"""Adam on a pose, as the first-order methods run it, and what is reported of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from torch import Tensor

from hecbench import se3
from hecbench.errors import SolverFailure
from hecbench.estimate import Estimate, Status, Termination
from hecbench.se3 import Array
from hecbench_plugins.first_order.adam import Adam
from hecbench_plugins.first_order.drawing import Drawer
from hecbench_plugins.first_order.poses import PoseNumbers
from hecbench_plugins.first_order.rendered import rendered
from hecbench_plugins.second_order import evidence
from hecbench_plugins.second_order.descent import Trace
from hecbench_plugins.views.pyramid import View

_PATH_STEPS = 40
"""Poses kept of a run for its figure."""


@dataclass(frozen=True)
class Verdict:
    """What an objective says of one set of pictures.

    Attributes:
        loss: to be lowered.
        stage: name of the stage that the run is in.
        turns: whether the rotation takes part.
        rank: loss by which the best iterate is chosen among those of the same `round`; None: not a candidate.
        round: pictures of different rounds cannot be compared; a later one replaces what was best.
    """

    loss: Tensor
    stage: str
    turns: bool = True
    rank: float | None = None
    round: int = 0


Objective = Callable[[Sequence[Tensor], Array], Verdict]
"""From the pictures (C, h, w) of every view's box and camera_T_parent. The boxes are in `Drawer.box`."""


@dataclass(frozen=True)
class AdamSettings:
    """What differs between the methods.

    `freeze_by_zero`: while the rotation takes no part its slope is set to zero and its moments go on, so that it
    drifts on and leaps when it is released; otherwise its step is left out and its moments start anew.
    """

    iterations: int
    rate: float
    weight_decay: float = 0.0
    freeze_by_zero: bool = False


@dataclass
class DescentHistory:
    """What happened. Poses are camera_T_parent."""

    last: Array
    best: Array | None = None
    best_iteration: int | None = None
    iterations: int = 0
    in_frame: bool = True
    steps_by_stage: dict[str, int] = field(default_factory=dict)
    loss: float = np.nan
    path: list[tuple[str, Array, float]] = field(default_factory=list)
    _best_rank: tuple[int, float] = (0, np.inf)

    def note(self, verdict: Verdict, in_path: bool) -> None:
        """Count an iteration, keep its pose if it is the best so far, and in the path if asked."""
        self.loss = float(verdict.loss.detach())
        self.steps_by_stage[verdict.stage] = self.steps_by_stage.get(verdict.stage, 0) + 1
        if in_path:
            self.path.append((verdict.stage, self.last, self.loss))
        if verdict.rank is not None and (-verdict.round, verdict.rank) < self._best_rank:
            self.best, self.best_iteration = self.last, self.iterations
            self._best_rank = -verdict.round, verdict.rank
        self.iterations += 1


def descend(
    drawers: Sequence[Drawer], numbers: PoseNumbers, objective: Objective, settings: AdamSettings
) -> DescentHistory:
    """Run all iterations, or until the robot has left every picture.

    Raises:
        SolverFailure: the loss or its derivative is not finite.
    """
    translation, rotation = (
        Adam(part.copy(), settings.rate, settings.weight_decay) for part in numbers.start
    )
    leaves = (
        torch.from_numpy(translation.values).requires_grad_(),
        torch.from_numpy(rotation.values).requires_grad_(),
    )
    run = DescentHistory(last=numbers.pose(translation.values, rotation.values))
    every = max(1, settings.iterations // (_PATH_STEPS - 2))
    turned = True
    with _one_thread():
        for iteration in range(settings.iterations):
            pictures = [rendered(*leaves, drawer, numbers, run.last) for drawer in drawers]
            if all(drawer.box is None for drawer in drawers):
                break
            verdict = objective(pictures, run.last)
            shift, turn = (slope.numpy() for slope in torch.autograd.grad(verdict.loss, leaves))
            run.note(verdict, in_path=iteration % every == 0)
            _check(run, shift, turn)
            translation.step(shift)
            if verdict.turns:
                if not turned and not settings.freeze_by_zero:
                    rotation.restart()
                rotation.step(turn)
            elif settings.freeze_by_zero:
                rotation.step(np.zeros(3))
            turned = verdict.turns
            run.last = numbers.pose(translation.values, rotation.values)
    for drawer in drawers:
        drawer.draw(run.last)
    run.in_frame = any(drawer.box is not None for drawer in drawers)
    run.path.append(("end", run.last, run.loss))
    return run


def _check(run: DescentHistory, *slopes: Array) -> None:
    """Raises SolverFailure when the loss or one of its slopes is not finite."""
    if not np.isfinite([run.loss, *(slope.sum() for slope in slopes)]).all():
        raise SolverFailure(
            f"iteration {run.iterations}: the loss or its derivative is not finite: the camera came too near to the"
            " robot"
        )


@contextmanager
def _one_thread() -> Iterator[None]:
    """Torch on one core: the arrays are small, and runs go side by side."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def to_estimate(
    run: DescentHistory,
    views: Sequence[View],
    drawers: Sequence[Drawer],
    pose: Array,
    diagnostics: Mapping[str, Any],
) -> Estimate:
    """The estimate of a run: its answer is `pose`, camera_T_parent, the last iterate or the best.

    A run that ended with the robot outside every picture has no answer, whatever it passed on its way. Its path is
    kept all the same.
    """
    details = {
        "in_frame": run.in_frame,
        "loss": run.loss,
        "steps_by_stage": run.steps_by_stage,
        "path": evidence.path_json(run.path),
        **diagnostics,
    }
    renders = (run.iterations + 1) * len(drawers)
    if not run.in_frame:
        return Estimate(
            status=Status.FAILED,
            reason=(
                f"the robot left the picture in iteration {run.iterations}: the start is too far off"
                if run.iterations
                else "the robot is not in the picture at the start: check the start's units and direction"
            ),
            termination=Termination.OUT_OF_FRAME,
            iterations=run.iterations,
            renders=renders,
            diagnostics=details,
        )
    details["overlap"] = evidence.overlap(views, pose, Trace())
    if pose is run.best:
        details["best_iteration"] = run.best_iteration
        details["last_parent_T_camera"] = se3.inverse(run.last)
    return Estimate(
        se3.inverse(pose),
        termination=Termination.MAX_ITERATIONS,
        iterations=run.iterations,
        renders=renders,
        diagnostics=details,
    )
