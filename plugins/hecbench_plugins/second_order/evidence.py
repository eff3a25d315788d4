"""What `render_gn` says about its answer: overlap, covariance, observability, the pose ambiguity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.estimate import Estimate, Termination
from hecbench.samples.spread import evenly
from hecbench.se3 import Array
from hecbench_plugins.second_order.descent import Descent, Trace, draw_counted
from hecbench_plugins.second_order.flatness import edge_excess
from hecbench_plugins.second_order.photometry import Photometry
from hecbench_plugins.second_order.settings import EVIDENCE
from hecbench_plugins.second_order.silhouette import contour_rows, distances_at, outer
from hecbench_plugins.views.common_error import Middle, common_error
from hecbench_plugins.views.pyramid import View

_HALF_TURN = np.diag([-1.0, -1.0, 1.0, 1.0])
"""About the root link's vertical axis: from there a symmetric arm looks much the same."""


@dataclass(frozen=True, eq=False)
class FinalStage:
    """The last stage: its name, where it ended, and what it compared."""

    kind: str
    descent: Descent
    photometry: Photometry
    extras: Mapping[str, Any] = field(default_factory=dict)
    covariance: Array | None = None
    """(6, 6) of the left perturbation of camera_T_parent when more than the camera was solved for."""
    rivals: tuple[Array, ...] = ()
    """camera_T_parent where other stages ended that explain the same evidence."""


def overlap(views: Sequence[View], pose: Array, trace: Trace) -> float:
    """The least intersection over union of drawing and mask among the views, at half size, where seen."""
    values = []
    for view in views:
        at = draw_counted(view, 2, pose, trace)
        drawn, seen = at.drawn(), at.observed[..., 3] > 0.5
        values.append(float((drawn & seen).sum() / max((drawn | seen).sum(), 1)))
    return min(values)


def contour_found(views: Sequence[View], pose: Array, trace: Trace) -> float:
    """The least share among the views of the drawn contour within `EVIDENCE.near_px` of the mask's, at full size."""
    shares = []
    for view, distance in zip(views, distances_at(views, 1), strict=True):
        at = draw_counted(view, 1, pose, trace)
        off, _ = contour_rows(at.renderer.crossings, outer(at), distance)
        shares.append(float((np.abs(off) < EVIDENCE.near_px).sum() / max(len(off), 1)))
    return min(shares)


def to_estimate(
    views: Sequence[View], end: FinalStage, iou: float, trace: Trace, termination: Termination
) -> Estimate:
    """The estimate with its evidence: covariance, observability, and the test of the other side.

    The covariance is the inverse Fisher information of the last comparison, Huber off, with the noise of its own
    residuals (Hartley and Zisserman 2004, section 5.2); correlated residuals count as fewer. The errors of the
    estimated colours are carried on, and so is what stages that explain the same evidence disagree about, and the
    error that all pictures share, as far as their edges are not drawn ones.
    """
    camera_T_parent = end.descent.pose
    end.photometry.huber = np.inf
    information = end.photometry(camera_T_parent)[1][:6, :6]
    noise = end.photometry.noise()
    values, directions = _scaled(information, camera_T_parent, views)
    diagnostics: dict[str, Any] = {
        "stage": end.kind,
        "overlap": iou,
        "noise": noise,
        "condition": float(values[-1] / values[0]),
    }
    seen_from_camera: NDArray[np.floating] | None = end.covariance
    if seen_from_camera is None and values[0] > EVIDENCE.blind * values[-1]:
        inverse = np.linalg.inv(information)
        if end.kind == "colour":
            inverse += inverse @ end.photometry.colour_information() @ inverse
        seen_from_camera = (EVIDENCE.roughness * noise) ** 2 * inverse + _disagreement(end)
    parent_T_camera = se3.inverse(camera_T_parent)
    covariance = None
    if seen_from_camera is not None:
        focal_px = float(np.asarray(views[0].levels[1].renderer.K)[0, 0])
        shared = common_error(camera_T_parent, [view.parent_T_link for view in views], focal_px)
        if end.kind == "colour":
            shared *= min(1.0, edge_excess(end.photometry) / EVIDENCE.averaged_edges) ** 2
        covariance = se3.inverse_covariance(camera_T_parent, seen_from_camera + shared)
    diagnostics["weakest_direction"] = [round(float(part), 3) for part in directions[:, 0]]
    parent_T_root = views[0].parent_T_link[0]
    other_side = parent_T_root @ _HALF_TURN @ se3.inverse(parent_T_root)
    diagnostics["path"] = path_json(trace.poses)
    diagnostics["overlap_from_the_other_side"] = overlap(views[:1], camera_T_parent @ other_side, trace)
    return Estimate(
        parent_T_camera,
        covariance=covariance,
        termination=termination,
        iterations=trace.iterations,
        renders=trace.renders,
        diagnostics=diagnostics,
        extras=end.extras,
    )


def _disagreement(end: FinalStage) -> Array:
    """Sum (6, 6) of d d' over the rivals, d the left perturbation of camera_T_parent from the end to a rival."""
    moves = [se3.log(rival @ se3.inverse(end.descent.pose)) for rival in end.rivals]
    return np.asarray(sum((np.outer(move, move) for move in moves), np.zeros((6, 6))))


def path_json(steps: list[tuple[str, Array, float]]) -> list[list[Any]]:
    """Stage, cost and log of parent_T_camera of the steps, thinned to `EVIDENCE.path_steps`, first and last kept."""
    return [
        [stage, None if np.isnan(cost) else round(cost, 6), se3.log(se3.inverse(pose)).round(6).tolist()]
        for stage, pose, cost in (steps[i] for i in evenly(len(steps), EVIDENCE.path_steps))
    ]


def _scaled(information: Array, camera_T_parent: Array, views: Sequence[View]) -> tuple[Array, Array]:
    """Eigenvalues, ascending, and directions (6, 6) of the information about the middle of the robot.

    A twist [phi, rho] about that point, rotation times half the robot's size: both parts are lengths then.
    """
    about = Middle.of(camera_T_parent, [view.parent_T_link for view in views]).lengths()
    values, directions = np.linalg.eigh(about.T @ information @ about)
    return np.maximum(values, 1e-300), directions
