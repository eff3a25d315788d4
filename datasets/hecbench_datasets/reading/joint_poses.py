"""Flange poses of joints whose robot is not named: of the URDF beside them, or of every known arm that fits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hecbench.errors import InputError
from hecbench.exchange.pose_numbers import PoseConvention
from hecbench.recording import RobotDescription
from hecbench.robots.model import KNOWN_ARMS, load_robot
from hecbench.se3 import Array
from hecbench_datasets.reading.arms import PANDA

_RADIANS = {"rad": 1.0, "deg": np.pi / 180}
_LIMITS = {"rad": (0.0, 3 * np.pi), "deg": (np.pi / 2, np.inf)}
"""Between which the largest angle of a recording lies."""
FLANGES = ("tool0", "flange", "panda_link8", "panda_hand", "fr3_link8", "link_eef")
BASES = ("base", "base_link", "panda_link0", "fr3_link0", "link_base")


@dataclass(frozen=True, eq=False)
class RobotReading:
    """One reading of the robot's numbers; the robot and (N, J) rad where they were joints."""

    flange: PoseConvention
    robot: RobotDescription | None = None
    joints_rad: Array | None = None

    def at(self, rows: Any) -> RobotReading:
        """The same of some rows."""
        flange = replace(self.flange, poses=self.flange.poses[rows])
        return RobotReading(flange, self.robot, None if self.joints_rad is None else self.joints_rad[rows])

    @property
    def base_T_flange(self) -> Array | None:
        """(N, 4, 4), where they do not follow from the joints of a robot with a model."""
        return None if self.robot and self.robot.source else self.flange.poses


def joint_readings(
    joints: Array, names: Sequence[str], robots: Sequence[str | Path], units: Sequence[str] = ("rad", "deg")
) -> list[RobotReading]:
    """Every arm and unit that the joints fit.

    Args:
        joints: (N, J), rad or degrees.
        names: of the columns; those of a URDF's joints put them into its order.
        robots: names of known arms, or URDF files; none: every known arm.
        units: "rad", "deg" or both.

    Raises:
        InputError: no arm has so many joints, or they lie outside all limits.
    """
    found: list[RobotReading] = []
    faults = []
    for robot in robots or (*KNOWN_ARMS, "panda"):
        for unit in units:
            if not _LIMITS[unit][0] < np.abs(joints).max() < _LIMITS[unit][1]:
                continue
            try:
                found += _of_robot(robot, joints * _RADIANS[unit], names, unit)
            except InputError as error:
                faults.append(str(error))
    if not found:
        raise InputError(faults[0] if faults else f"no known arm has {joints.shape[1]} joints")
    return found


def _of_robot(robot: str | Path, joints: Array, names: Sequence[str], unit: str) -> Iterator[RobotReading]:
    if robot == "panda":
        if joints.shape[1] != 7:
            raise InputError(f"{joints.shape[1]} joints are not a Panda's seven")
        described = RobotDescription(
            base_link=PANDA.base_link, flange_link=PANDA.flange_link, joint_names=PANDA.joint_names
        )
        poses = PANDA.base_T_flange(joints)
    else:
        described, joints, poses = _described(robot, joints, names)
    text = f"{Path(robot).stem} joints in {unit}"
    yield RobotReading(PoseConvention(poses, f"base_T_flange {text}"), described, joints)


def _described(
    robot: str | Path, joints: Array, names: Sequence[str]
) -> tuple[RobotDescription, Array, Array]:
    """The robot, its joints in its order, and its flange poses."""
    known = robot in KNOWN_ARMS
    model = load_robot(robot, meshes=False)
    own = model.joint_names
    called = [str(name).split(".")[-1] for name in names]
    if set(called) >= set(own):
        joints = joints[:, [called.index(name) for name in own]]
    elif len(own) >= joints.shape[1] and (known is False or len(own) == joints.shape[1]):
        own = tuple(name for name in called if name in own) or own[: joints.shape[1]]
    if len(own) != joints.shape[1]:
        raise InputError(
            f"{robot}: has {len(own)} joints, the table {joints.shape[1]}; name its columns as the joints"
        )
    base = next((link for link in BASES if link in model.links), model.links[0])
    flange = next((link for link in FLANGES if link in model.links), model.joints[-1].child)
    described = RobotDescription(
        model=str(robot) if known else None,
        urdf=None if known else Path(robot),
        base_link=base,
        flange_link=flange,
        joint_names=own,
    )
    return described, joints, model.forward(joints, own, base=base, tip=flange)
