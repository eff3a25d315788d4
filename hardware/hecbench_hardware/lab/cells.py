"""The cells of the paper's trials: where the cameras, the workpiece and the calibration tag stand.

Eighteen calibrations of the UR5e: nine camera poses about 2 m from the base along x, each with the arm in two
configurations; the workpiece at three places makes 54 trials. Six calibrations of the VS060 make 18. The room
has x to the front, the table's top at z = 0; a UR's base is turned in it by pi.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import CameraModel
from hecbench.robots.model import RobotModel, load_robot
from hecbench.robots.posed import cached_robot
from hecbench.se3 import Array
from hecbench_hardware.kinematics import ARMS, JOINT_NAMES, Arm
from hecbench_hardware.lab.scene import FlangeTag, Scene, Surroundings
from hecbench_hardware.lab.urdf_arm import UrdfArm
from hecbench_hardware.limits import Box, Limits, Sphere
from hecbench_hardware.trials import solids

DISTANCE_M = 2.0
_LOOK_AT_M = np.array([0.35, 0.0, 0.22])
_TAG_BESIDE_FLANGE_M = 0.09
_WIDTH, _HEIGHT, _FOCAL_PX = 2448, 2048, 2319.0
_PLACES = ((0.42, -0.12, 0.20), (0.48, 0.02, -0.12), (0.40, 0.12, -0.30))
"""x, y, yaw of the workpiece in the room."""
_AZIMUTHS_RAD, _HEIGHTS_M = np.deg2rad([-22.0, 0.0, 22.0]), (0.35, 0.75, 1.15)


@dataclass(frozen=True, eq=False)
class Station:
    """One kind of arm in the room.

    Attributes:
        name: of the arm, as the lab calls it.
        arm: its kinematics.
        model: name or URDF for `hecbench.robots.model.load_robot`.
        gripper: carried by the flange.
        base_T_room: (4, 4) m.
        configurations_rad: (C, J) where the calibrations are made.
        home_rad: (J,) where the arm hides nothing.
        cameras: how many camera poses.
        base_link, flange_link: the frames of `base_T_flange`.
    """

    name: str
    arm: Arm
    model: str
    gripper: solids.Gripper
    base_T_room: Array
    configurations_rad: Array
    home_rad: Array
    cameras: int
    base_link: str
    flange_link: str
    joint_names: tuple[str, ...]

    @property
    def calibrations(self) -> int:
        """Camera poses times configurations."""
        return self.cameras * len(self.configurations_rad)

    @cached_property
    def robot(self) -> RobotModel:
        """The meshes, with the gripper where it has some."""
        own = f"{self.model}+{self.gripper.name}"
        return load_robot(own if self.draws_gripper_meshes else self.model)

    @property
    def draws_gripper_meshes(self) -> bool:
        """Whether the robot's model brings the gripper's meshes."""
        return self.model in ARMS and self.gripper.name == "robotiq_2f_85"

    @cached_property
    def _joint_limits_rad(self) -> Array:
        return cached_robot(self.model, meshes=False).limits(self.joint_names)

    @property
    def limits(self) -> Limits:
        """The lab's own: nothing real can break, but the flange stays above the table."""
        lower, upper = np.clip(self._joint_limits_rad, -2 * np.pi, 2 * np.pi).T
        return Limits(
            joint_lower_rad=tuple(lower),
            joint_upper_rad=tuple(upper),
            joint_speed_rad_s=3.0,
            joint_acceleration_rad_s2=10.0,
            tool_speed_m_s=1.0,
            tool_acceleration_m_s2=5.0,
            workspace=Box((-1.3, -1.3, -0.1), (1.3, 1.3, 1.8)),
            tool=(Sphere((0.0, 0.0, 0.0), 0.05),),
        )

    def scene(
        self,
        *,
        flange_tag: FlangeTag | None = None,
        workpiece: bool = False,
        peg: bool = False,
        room: int = 0,
    ) -> Scene:
        """The arm in the room, with its gripper, and what else is in it; `room` is the seed of the clutter."""
        return Scene(
            self.robot,
            joint_names=self.joint_names,
            base_link=self.base_link,
            flange_link=self.flange_link,
            gripper=None if self.draws_gripper_meshes else self.gripper,
            peg_of=self.gripper if peg else None,
            flange_tag=flange_tag,
            workpiece=workpiece,
            surroundings=Surroundings(room, base_T_room=self.base_T_room),
        )

    def camera_pose(self, number: int) -> Array:
        """base_T_camera (4, 4) m of a calibration."""
        camera = self._checked(number) // len(self.configurations_rad)
        azimuth, height = _AZIMUTHS_RAD[camera % 3], _HEIGHTS_M[camera // 3 % 3]
        eye = [DISTANCE_M * np.cos(azimuth), DISTANCE_M * np.sin(azimuth), height]
        return np.asarray(self.base_T_room @ looking_at(np.array(eye), _LOOK_AT_M))

    def configuration_rad(self, number: int) -> Array:
        """Joints (J,) around which a calibration is made."""
        return np.asarray(self.configurations_rad[self._checked(number) % len(self.configurations_rad)])

    def workpiece_pose(self, place: int) -> Array:
        """base_T_workpiece (4, 4) m."""
        if not 0 <= place < len(_PLACES):
            raise InputError(f"place {place} is outside the workspace: the lab has 0 to {len(_PLACES) - 1}")
        x, y, yaw = _PLACES[place]
        return np.asarray(self.base_T_room @ se3.from_rotvec([0.0, 0.0, yaw], [x, y, 0.0]))

    def flange_tag(self, number: int) -> FlangeTag:
        """The calibration tag beside the flange, turned to the front in the calibration's configuration."""
        base_T_flange = self.arm.forward(self.configuration_rad(number))
        room_R_tag = np.array([[0.0, 0, -1], [1, 0, 0], [0, -1, 0]])
        base_R_tag = self.base_T_room[:3, :3] @ room_R_tag
        flange_R_tag = base_T_flange[:3, :3].T @ base_R_tag
        return FlangeTag(solids.TAG, se3.make(flange_R_tag, -_TAG_BESIDE_FLANGE_M * flange_R_tag[:, 2]))

    def _checked(self, number: int) -> int:
        if not 0 <= number < self.calibrations:
            raise InputError(f"calibration {number}: the lab's {self.name} has 0 to {self.calibrations - 1}")
        return number


def camera_model(width: int = _WIDTH, height: int = _HEIGHT, focal_px: float | None = None) -> CameraModel:
    """The camera of the paper, or one of another size with the same field of view."""
    focal = _FOCAL_PX * width / _WIDTH if focal_px is None else focal_px
    return CameraModel.centred(width, height, focal)


def looking_at(eye_m: Array, target_m: Array) -> Array:
    """The pose (4, 4) of a camera at a point that looks at another, its x axis horizontal."""
    z = (target_m - eye_m) / np.linalg.norm(target_m - eye_m)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    return se3.make(np.column_stack([x, np.cross(z, x), z]), eye_m)


def ur5e() -> Station:
    """The UR5e with the Robotiq gripper, its base turned so that its zero pose points to the front."""
    return Station(
        name="ur5e",
        arm=ARMS["ur5e"],
        model="ur5e",
        gripper=solids.GRIPPERS["robotiq_2f_85"],
        base_T_room=se3.from_rotvec([0.0, 0.0, np.pi], np.zeros(3)),
        configurations_rad=np.deg2rad(
            [[0.0, -90.0, 90.0, -90.0, -90.0, 0.0], [25.0, -105.0, 100.0, -85.0, -90.0, 40.0]]
        ),
        home_rad=np.deg2rad([0.0, -120.0, 80.0, -50.0, -90.0, 0.0]),
        cameras=9,
        base_link="base",
        flange_link="tool0",
        joint_names=JOINT_NAMES,
    )


def vs060(urdf: str) -> Station:
    """The DENSO VS060 of a URDF file with an RG2-like gripper."""
    arm = UrdfArm.load("vs060", urdf)
    return Station(
        name="vs060",
        arm=arm,
        model=urdf,
        gripper=solids.GRIPPERS["rg2"],
        base_T_room=np.eye(4),
        configurations_rad=np.deg2rad(
            [[0.0, 0.0, 90.0, 0.0, 90.0, 0.0], [20.0, -10.0, 100.0, 0.0, 90.0, 30.0]]
        ),
        home_rad=np.deg2rad([0.0, -40.0, 130.0, 0.0, 90.0, 0.0]),
        cameras=3,
        base_link=arm.base_link,
        flange_link=arm.flange_link,
        joint_names=arm.chain.joint_names,
    )


def station(name: str, urdf: str | None = None) -> Station:
    """The lab's arm by name; the VS060 needs its URDF."""
    if name == "ur5e":
        return ur5e()
    if name == "vs060" and urdf:
        return vs060(urdf)
    if name == "vs060":
        raise InputError("the lab's vs060 needs its URDF: --set robot.urdf=PATH")
    raise InputError(f"the lab has no arm '{name}': choose ur5e or vs060")
