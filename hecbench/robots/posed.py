"""The robot of a recording: its model, its joints by name, and where its links are in every sample."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import Recording
from hecbench.robots.model import RobotModel, load_robot

Array = NDArray[np.float64]

_STEP_RAD = 1e-4
"""Of the central differences that give the joints' twists; their error is its square."""


def cached_robot(source: str | Path, *, meshes: bool = True) -> RobotModel:
    """`load_robot`, read once per process and again when the URDF has changed."""
    path = Path(source)
    return _loaded(source, meshes, path.stat().st_mtime_ns if path.is_file() else 0)


@lru_cache(maxsize=8)
def _loaded(source: str | Path, meshes: bool, modified_ns: int) -> RobotModel:
    return load_robot(source, meshes=meshes)


@dataclass(frozen=True, eq=False)
class PosedRobot:
    """A robot model with the joints of N samples.

    Attributes:
        source: name of the robot, or its URDF.
        model: kinematics, and meshes where they were asked for.
        joint_names: J names; those of the recording, or the first J of the model.
        joints_rad: (N, J), NaN rows where a sample has no joints.
        base_link, flange_link: the links between which base_T_flange is given.
        parent_link: the frame that link poses are given in.
    """

    source: str | Path
    model: RobotModel
    joint_names: tuple[str, ...]
    joints_rad: Array
    base_link: str
    flange_link: str
    parent_link: str

    @staticmethod
    def of(recording: Recording, *, meshes: bool = True) -> PosedRobot:
        """The robot that a recording describes.

        Raises:
            InputError: it names no robot model, there is no such model, link or joint, or the model is faulty.
        """
        robot = recording.robot
        if robot is None or robot.source is None:
            raise InputError(
                f"{recording.name}: names no robot model: give robot.model or robot.urdf, or import it with --urdf"
            )
        model = cached_robot(robot.source, meshes=meshes)
        joints = recording.joints_rad
        names = robot.joint_names or model.joint_names[: None if joints is None else joints.shape[1]]
        model.limits(names)
        return PosedRobot(
            robot.source,
            model,
            tuple(names),
            np.full((len(recording), len(names)), np.nan) if joints is None else joints,
            robot.base_link,
            robot.flange_link,
            recording.parent_link,
        )

    @cached_property
    def samples(self) -> NDArray[np.int64]:
        """The rows that have joints; the robot cannot be placed in the others."""
        return np.flatnonzero(np.isfinite(self.joints_rad).all(1))

    @cached_property
    def base_T_flange(self) -> Array:
        """(N, 4, 4) m by forward kinematics, NaN rows where joints are absent.

        Raises:
            InputError: joints lie outside their limits.
        """
        poses = np.full((len(self.joints_rad), 4, 4), np.nan)
        poses[self.samples] = self.model.forward(
            self.joints_rad[self.samples], self.joint_names, base=self.base_link, tip=self.flange_link
        )
        return poses

    def link_poses(self, joints_rad: Array) -> Array:
        """parent_T_link (..., L, 4, 4) m at joints (..., J); an `InputError` for joints outside their limits."""
        return self.model.link_poses(joints_rad, self.joint_names, frame=self.parent_link)

    def clipped_link_poses(self, joints_rad: Array) -> Array:
        """The same, joints outside their limits taken at the limit."""
        lower, upper = self.model.limits(self.joint_names).T
        return self.link_poses(np.clip(joints_rad, lower, upper))

    def twists(self, joints_rad: Array) -> Array:
        """Left twists (..., J, L, 6) of parent_T_link per rad of every joint, at joints (..., J)."""
        steps = _STEP_RAD * np.eye(joints_rad.shape[-1])
        after = self.clipped_link_poses(joints_rad[..., None, :] + steps)
        before = self.clipped_link_poses(joints_rad[..., None, :] - steps)
        return np.asarray(se3.log(after @ se3.inverse(before)) / (2 * _STEP_RAD))
