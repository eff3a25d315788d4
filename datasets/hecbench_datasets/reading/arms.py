"""Forward kinematics of arms whose recordings come without a robot model, from published parameters.

Craig's convention (Craig 2005, "Introduction to robotics", eq. 3.6): link i is placed by a rotation alpha and a shift a
about the last x, then a rotation theta and a shift d about z.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hecbench import se3
from hecbench.se3 import Array


@dataclass(frozen=True)
class Arm:
    """An arm by its parameters.

    Attributes:
        base_link: of URDFs of this arm.
        flange_link: of URDFs of this arm.
        joint_names: of URDFs of this arm.
        rows: a m, alpha rad, d m, and theta's offset rad of each joint.
        base_T_first: (4, 4) where the first row starts.
        last_T_flange: (4, 4) behind the last joint.
        frame_of: the number of the joint behind which a link's frame is; 0 is the base.
    """

    base_link: str
    flange_link: str
    joint_names: tuple[str, ...]
    rows: tuple[tuple[float, float, float, float], ...]
    base_T_first: Array
    last_T_flange: Array
    frame_of: dict[str, int]

    def link_origins(self, joints_rad: ArrayLike, links: tuple[str, ...]) -> Array:
        """Origins (N, L, 3) m of links of `frame_of`, or the flange, in the base frame."""
        frames = self._frames(joints_rad)
        flange = frames[-1] @ self.last_T_flange
        chosen = [flange if link == self.flange_link else frames[self.frame_of[link]] for link in links]
        return np.stack([pose[..., :3, 3] for pose in chosen], axis=-2)

    def base_T_flange(self, joints_rad: ArrayLike) -> Array:
        """(N, 4, 4) m of joints (N, J) rad."""
        return np.asarray(self._frames(joints_rad)[-1] @ self.last_T_flange)

    def _frames(self, joints_rad: ArrayLike) -> list[Array]:
        """The base and the frame behind each joint, each (N, 4, 4)."""
        joints = np.asarray(joints_rad, float)
        frames = [np.broadcast_to(np.eye(4), (*joints.shape[:-1], 4, 4))]
        moved = np.asarray(self.base_T_first)
        for column, (a, alpha, d, offset) in enumerate(self.rows):
            angle = joints[..., column] + offset
            turn = np.zeros((*angle.shape, 3))
            turn[..., 2] = angle
            across = se3.from_rotvec([alpha, 0, 0], [a, 0, 0])
            along = se3.make(se3.so3_exp(turn), np.broadcast_to([0, 0, d], turn.shape))
            moved = moved @ across @ along
            frames.append(moved)
        return frames


_RIGHT = np.pi / 2

PANDA = Arm(
    base_link="panda_link0",
    flange_link="panda_hand",
    joint_names=tuple(f"panda_joint{i}" for i in range(1, 8)),
    rows=(
        (0, 0, 0.333, 0),
        (0, -_RIGHT, 0, 0),
        (0, _RIGHT, 0.316, 0),
        (0.0825, _RIGHT, 0, 0),
        (-0.0825, -_RIGHT, 0.384, 0),
        (0, _RIGHT, 0, 0),
        (0.088, _RIGHT, 0, 0),
    ),
    base_T_first=np.eye(4),
    last_T_flange=se3.from_rotvec([0, 0, -np.pi / 4], [0, 0, 0.107]),
    frame_of={f"panda_link{i}": i for i in range(8)},
)
"""Franka Emika, "Franka control interface documentation", table of DH parameters; the hand turned by -45 deg."""

BAXTER_LEFT = Arm(
    base_link="left_arm_mount",
    flange_link="left_hand",
    joint_names=tuple(f"left_{name}" for name in ("s0", "s1", "e0", "e1", "w0", "w1", "w2")),
    rows=(
        (0, 0, 0, 0),
        (0.069, -_RIGHT, 0, _RIGHT),
        (0, _RIGHT, 0.36435, 0),
        (0.069, -_RIGHT, 0, 0),
        (0, _RIGHT, 0.37429, 0),
        (0.010, -_RIGHT, 0, 0),
        (0, _RIGHT, 0, 0),
    ),
    base_T_first=se3.make(np.eye(3), np.array([0, 0, 0.27035])),
    last_T_flange=se3.make(np.eye(3), np.array([0, 0, 0.229525])),
    frame_of={},
)
"""Williams 2017, "Baxter humanoid robot kinematics", Ohio University, table 1."""
BAXTER_END_EFFECTOR_M = (0.0, 0.0, 0.138775)
"""The point that the Baxter set calls the end-effector, in `left_hand`: 0.3683 m beyond the wrist's centre."""
