"""More unknowns than the camera: joint offsets, the robot's scale, the focal length, each with a prior."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np

from hecbench import se3
from hecbench.rendering import Crossings
from hecbench.robots.posed import PosedRobot
from hecbench.se3 import Array
from hecbench_plugins.second_order.descent import Descent, NormalEquations
from hecbench_plugins.second_order.photometry import Photometry
from hecbench_plugins.second_order.settings import DESCENT, EVIDENCE
from hecbench_plugins.views.pyramid import Level, View


class Unknown(StrEnum):
    """What else may be solved for."""

    JOINTS = "joints"
    SCALE = "scale"
    FOCAL = "focal"


PRIOR = {Unknown.JOINTS: EVIDENCE.joints_rad, Unknown.SCALE: EVIDENCE.scale, Unknown.FOCAL: EVIDENCE.focal}
"""Standard deviations about 0: rad, and relative."""


@dataclass(eq=False)
class ExtendedPhotometry(Photometry):
    """Photometry with more columns: the offsets of all joints (rad), log scale, log focal factor.

    `values` holds their current estimates. The robot is scaled about the parent's origin.
    """

    robot: PosedRobot = field(kw_only=True)
    free: tuple[Unknown, ...] = field(kw_only=True)

    def __post_init__(self) -> None:
        self.labels = [
            (unknown, name)
            for unknown in self.free
            for name in (self.robot.joint_names if unknown is Unknown.JOINTS else (str(unknown),))
        ]
        self.sigmas = np.array([PRIOR[unknown] for unknown, _ in self.labels])
        self.values = np.zeros(len(self.labels))
        self.unknowns = 6 + len(self.labels)
        super().__post_init__()

    def value(self, unknown: Unknown) -> Array:
        """The current values of one kind, empty when it is not free."""
        return self.values[[kind is unknown for kind, _ in self.labels]]

    def draw(self, view: View, pose: Array) -> Level:
        """Draw with the current values; a scaled robot is the robot seen from a scaled distance."""
        at = view.levels[self.level]
        at.renderer.scale_focal(float(np.exp(self.value(Unknown.FOCAL).sum())))
        camera_T_parent = pose.copy()
        camera_T_parent[:3, 3] /= self._scale()
        at.renderer.draw(camera_T_parent @ self._parent_T_link(view))
        return at

    def columns(self, view: View, crossings: Crossings, pose: Array) -> Array:
        """dt by pose, joints, log scale and log focal length."""
        scale = self._scale()
        pose_columns = crossings.pose_columns()
        pose_columns[:, 3:] /= scale
        point = scale * crossings.point.astype(float)
        groups = [pose_columns]
        for unknown in self.free:
            if unknown is Unknown.JOINTS:
                twists = np.einsum("ij,klj->kli", se3.adjoint(pose), self._joint_twists(view))
                groups.append(np.einsum("ni,jni->nj", pose_columns, twists[:, crossings.link]))
            elif unknown is Unknown.SCALE:
                groups.append((pose_columns[:, 3:] * (point - pose[:3, 3])).sum(1)[:, None])
            else:
                groups.append(_by_focal(crossings, view.levels[self.level]))
        return np.concatenate(groups, 1)

    def _scale(self) -> float:
        return float(np.exp(self.value(Unknown.SCALE).sum()))

    def _parent_T_link(self, view: View) -> Array:
        offsets = self.value(Unknown.JOINTS)
        if not len(offsets):
            return view.parent_T_link
        return self.robot.clipped_link_poses(view.joints_rad + offsets)

    def _joint_twists(self, view: View) -> Array:
        """Left twists (J, L, 6) of parent_T_link per rad of every joint, the links scaled with the robot."""
        scaled = self.robot.twists(view.joints_rad + self.value(Unknown.JOINTS))
        scaled[..., 3:] *= self._scale()
        return scaled


def _by_focal(crossings: Crossings, at: Level) -> Array:
    K = np.asarray(at.renderer.K, float)
    point, slope = crossings.point.astype(float), crossings.slope.astype(float)
    u = (K[0, 0] * point[:, 0] + K[0, 1] * point[:, 1]) / point[:, 2]
    v = K[1, 1] * point[:, 1] / point[:, 2]
    return np.asarray(np.where(crossings.horizontal, u - slope * v, v - slope * u)[:, None])


@dataclass(frozen=True, eq=False)
class Solved:
    """The pose, its covariance (6, 6) with the others unknown too, and what was found for the others."""

    descent: Descent
    covariance: Array
    extras: dict[str, Any]


def solve(photometry: ExtendedPhotometry, start: Array, noise: float, rounds: int = 30) -> Solved:
    """Levenberg-Marquardt over the pose and the other unknowns, the priors weighed by the pictures' noise."""
    prior = np.r_[np.zeros(6), (noise / photometry.sigmas) ** 2]
    pose, values, damping, ended = start, photometry.values.copy(), DESCENT.first_damping, "iterations"

    def evaluate(pose: Array, values: Array) -> NormalEquations:
        photometry.values = values
        cost, A, b = photometry(pose)
        state = np.r_[np.zeros(6), values]
        return cost + 0.5 * float(prior @ state**2), A + np.diag(prior), b - prior * state

    cost, A, b = evaluate(pose, values)
    for _ in range(rounds):
        photometry.trace.iterations += 1
        move = np.linalg.solve(A + np.diag(damping * np.diag(A) + 1e-12), b)
        moved = se3.exp(move[:6]) @ pose, values + move[6:]
        new = evaluate(*moved)
        better = new[0] < cost
        if better:
            (pose, values), (cost, A, b) = moved, new
            damping = max(DESCENT.relaxed * damping, 1e-9)
        if np.abs(move).max() < DESCENT.small_step * (1 if better else 10):
            ended = "converged"
            break
        if not better:
            damping *= DESCENT.tightened
    _, A, _ = evaluate(pose, values)
    size = 1 / np.sqrt(np.diag(A))
    covariance = noise**2 * np.linalg.inv(A * np.outer(size, size)) * np.outer(size, size)
    sigmas = np.sqrt(np.diag(covariance)[6:])
    names = [name for _, name in photometry.labels]
    return Solved(
        Descent(pose, cost, A, ended),
        covariance[:6, :6],
        details(names, values, sigmas, photometry.sigmas),
    )


def details(names: Sequence[str], values: Array, sigmas: Array, prior_sigmas: Array) -> dict[str, Any]:
    """What was found for each unknown, and whether the pictures said anything about it beside the prior."""
    return {
        name: {
            "value": float(value),
            "sigma": float(sigma),
            "observable": bool(sigma < EVIDENCE.unseen * prior),
        }
        for name, value, sigma, prior in zip(names, values, sigmas, prior_sigmas, strict=True)
    }
