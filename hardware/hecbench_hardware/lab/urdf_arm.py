"""The kinematics of a six-joint arm of any URDF; the inverse is found numerically.

Damped least squares (Wampler 1986) from the given joints and from a few fixed other ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from hecbench import se3
from hecbench.errors import InputError
from hecbench.robots.joints import Motion
from hecbench.robots.model import RobotModel, load_robot
from hecbench.se3 import Array

_ROUNDS = 60
_CLOSE = 1e-8
_DAMPING = 1e-4
_STEP_RAD = 0.4
_STARTS = 6


@dataclass(frozen=True)
class UrdfArm:
    """A chain of six revolute joints."""

    name: str
    chain: RobotModel
    """The joints and links."""
    base_link: str
    flange_link: str

    @classmethod
    def load(cls, name: str, urdf: str) -> UrdfArm:
        """From a file; the first link that moves hangs on the base, the last link is the flange.

        Raises:
            InputError: The file is unreadable or has not six revolute joints in a chain.
        """
        model = load_robot(Path(urdf), meshes=False)
        moving = [joint for joint in model.joints if joint.motion is Motion.REVOLUTE]
        if len(model.joint_names) != 6 or len(moving) != 6:
            raise InputError(f"{urdf}: the lab drives arms with six revolute joints, not {len(moving)}")
        return cls(name, model, moving[0].parent, moving[-1].child)

    def link_frames(self, joints_rad: ArrayLike) -> Array:
        """base_T_link (..., 6, 4, 4) after each joint, the last is base_T_flange."""
        chain = self.chain
        poses = chain.link_poses(joints_rad, frame=self.base_link)
        children = [
            chain.link_index(joint.child) for joint in chain.joints if joint.name in chain.joint_names
        ]
        return np.asarray(poses[..., children, :, :])

    def forward(self, joints_rad: ArrayLike) -> Array:
        """base_T_flange (..., 4, 4) of joints (..., 6) rad."""
        return np.asarray(self.link_frames(joints_rad)[..., 5, :, :])

    def inverse(self, base_T_flange: ArrayLike, near_rad: ArrayLike | None = None) -> Array:
        """Joint solutions (K, 6) rad, the one nearest to `near_rad` first; no row when none was found."""
        target = np.asarray(base_T_flange, float)
        limits = self.chain.limits()
        near = limits.mean(1) if near_rad is None else np.asarray(near_rad, float)
        rng = np.random.default_rng(0)
        others = (near + rng.normal(0.0, 0.6, 6) for _ in range(_STARTS))
        for start in (near, *others):
            joints = self._descend(target, np.clip(start, *limits.T), limits)
            if joints is not None:
                return joints[None]
        return np.zeros((0, 6))

    def _descend(self, target: Array, joints: Array, limits: Array) -> Array | None:
        steps = 1e-6 * np.eye(6)
        for _ in range(_ROUNDS):
            inside = np.clip(joints, limits[:, 0], limits[:, 1] - steps[0, 0])
            poses = self.forward(np.concatenate([inside[None], inside + steps]))
            errors = se3.log(target @ se3.inverse(poses))
            if np.abs(errors[0]).max() < _CLOSE:
                return np.asarray(inside)
            jacobian = (errors[1:] - errors[0]).T / steps[0, 0]
            normal = jacobian.T @ jacobian + _DAMPING * np.linalg.norm(errors[0]) * np.eye(6)
            step = np.linalg.solve(normal, -jacobian.T @ errors[0])
            joints = inside + step * min(1.0, _STEP_RAD / max(float(np.abs(step).max()), 1e-12))
        return None
