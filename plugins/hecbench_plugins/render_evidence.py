"""What `render_gn` says about its answer: overlap, covariance, observability, the pose ambiguity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.estimate import Estimate, Termination
from hecbench_plugins import render_stages as stages
from hecbench_plugins.render_views import View

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class End:
    """The last stage: its name, where it ended, and what it compared."""

    kind: str
    descent: stages.Descent
    photometry: stages.Photometry


def overlap(views: Sequence[View], pose: Array, trace: stages.Trace) -> float:
    """The least intersection over union of drawing and mask among the views, at half size."""
    values = []
    for view in views:
        at = stages.draw(view, 2, pose, trace)
        drawn, seen = at.renderer.face >= 0, at.observed[..., 3] > 0.5
        values.append(float((drawn & seen).sum() / max((drawn | seen).sum(), 1)))
    return min(values)


def answer(
    views: Sequence[View], end: End, iou: float, trace: stages.Trace, termination: Termination
) -> Estimate:
    """The estimate with its evidence."""
    camera_T_parent = end.descent.pose
    return Estimate(
        se3.inverse(camera_T_parent),
        termination=termination,
        iterations=trace.iterations,
        renders=trace.renders,
        diagnostics={"stage": end.kind, "overlap": iou},
    )
