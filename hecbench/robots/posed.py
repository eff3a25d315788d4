"""The robot of a recording: its model, its joints by name, and where its links are in every sample."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import InputError, Refusal
from hecbench.recording import Recording
from hecbench.robots.model import RobotModel, load_robot
from hecbench.se3 import Array

_FARTHEST_M = 50.0
"""Of the robot from a camera that calibrates it; the starts beyond are in millimetres."""
_OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
"""opencv_T_opengl: y up, z backward."""
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

    def check_start(self, recording: Recording) -> None:
        """Refuse a start from which no camera can see the robot, and say what it fits instead.

        Raises:
            Refusal: the robot is behind the camera, or farther off than any camera looks.
        """
        start = recording.initial_parent_T_camera
        if start is None or not len(self.samples):
            return
        origins = self.link_poses(self.joints_rad[self.samples])[..., :3, 3].reshape(-1, 3)

        def seen_from(parent_T_camera: Array) -> Array:
            return np.asarray(se3.transform_points(se3.inverse(parent_T_camera), origins))

        away = float(np.linalg.norm(seen_from(start).mean(0)))
        if away > _FARTHEST_M:
            raise Refusal(
                f"at the start the robot is {away:,.0f} m from the camera: initial_parent_T_camera in millimetres?"
            )
        if (seen_from(start)[:, 2] > 0).any():
            return
        others = {"OpenGL axes": start @ _OPENGL, "camera_T_parent: give its inverse": se3.inverse(start)}
        fitting = [name for name, pose in others.items() if _in_view(seen_from(pose), recording)]
        reason = f"; this start fits {fitting[0]}" if fitting else ""
        raise Refusal(f"at the start the robot is behind the camera: z must look forward (OpenCV){reason}")

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


def _in_view(points: Array, recording: Recording) -> bool:
    """Whether the middle of points (N, 3) m in the camera's frame is in its picture."""
    camera, middle = recording.camera, points.mean(0)
    if middle[2] <= 0 or camera is None or camera.K is None:
        return bool(middle[2] > 0)
    u, v, _ = camera.K @ (middle / middle[2])
    return bool(0 <= u < camera.width and 0 <= v < camera.height)
