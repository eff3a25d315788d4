"""The last refinement with constant joint offsets as further unknowns, within a prior."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hecbench import se3
from hecbench.robots.posed import PosedRobot
from hecbench.se3 import Array
from hecbench_plugins.maskless.contour import ContourEquations, ContourMatcher
from hecbench_plugins.maskless.refinement import Refined, RefinementLevel, limited, settled
from hecbench_plugins.maskless.settings import CONTOUR, COURSE
from hecbench_plugins.second_order.unknowns import details


@dataclass(frozen=True, eq=False)
class Offsets:
    """Where the refinement ended with joint offsets, and the offsets by joint."""

    refined: Refined
    extras: dict[str, Any]


def compare(
    lines: ContourMatcher,
    camera_T_parent: Array,
    robot: PosedRobot,
    offsets: Array,
    step: RefinementLevel,
    radius_m: float,
) -> ContourEquations:
    """The comparison at a pose and joint offsets (J,) rad, with a column of the normal equations for each joint."""
    joints = lines.canvas.joints_rad + offsets
    lines.parent_T_link = robot.clipped_link_poses(joints)
    twists = robot.twists(joints) @ se3.adjoint(camera_T_parent).T
    return lines(camera_T_parent, step.spacing, twists=list(twists), radius_m=radius_m)


def with_joint_offsets(
    lines: ContourMatcher, camera_T_parent: Array, robot: PosedRobot, step: RefinementLevel, radius_m: float
) -> Offsets:
    """Gauss-Newton over the camera and one offset per joint, the prior weighed as the correlated points it equals."""
    offsets = np.zeros(lines.canvas.joints_rad.shape[1])
    pose, converged, iteration = camera_T_parent, False, 0
    prior = CONTOUR.correlated_points * prior_information(len(offsets))
    lines.learn(pose, step.spacing)
    found = compare(lines, pose, robot, offsets, step, radius_m)
    for iteration in range(1, 2 * step.rounds + 1):  # noqa: B007 the number of the last is reported
        if found.points < CONTOUR.fewest_points:
            break
        A = found.A + np.diag(prior)
        b = found.b - prior * np.r_[np.zeros(6), offsets]
        move = limited(np.linalg.solve(A + 1e-3 * np.diag(np.diag(found.A)) + 1e-9 * np.eye(len(A)), b))
        pose, offsets = se3.exp(move[:6]) @ pose, offsets + move[6:]
        found = compare(lines, pose, robot, offsets, step, radius_m)
        converged = settled(found, move)
        if converged:
            break
    sigmas = np.sqrt(CONTOUR.correlated_points * np.diag(np.linalg.inv(found.A + np.diag(prior)))[6:])
    extras = details(robot.joint_names, offsets, sigmas, np.full(len(offsets), COURSE.joint_sigma_rad))
    return Offsets(Refined(pose, found, iteration, converged), extras)


def prior_information(joints: int) -> Array:
    """Of the camera's six numbers, none, and of every joint offset (6 + joints,)."""
    return np.concatenate([np.zeros(6), np.full(joints, 1 / COURSE.joint_sigma_rad**2)])
