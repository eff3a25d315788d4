"""The solids of the trials: workpiece, grippers and peg, as boxes and cylinders in metres.

docs/trials.md draws them and fixes what counts as success. The tool frame has its origin between the finger
pads, z along the fingers to their tips, x in the direction in which they open.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hecbench import se3
from hecbench.se3 import Array
from hecbench.targets import AprilTagTarget
from hecbench_hardware.limits import Sphere

Vector = tuple[float, float, float]

_WALL_PIECES = 32
_PLATE_TILT_RAD = np.pi / 4


@dataclass(frozen=True)
class Box:
    """Half sizes along the axes of its own frame, which `rotvec` turns."""

    name: str
    centre_m: Vector
    half_m: Vector
    rotvec: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Cylinder:
    """Along z."""

    name: str
    centre_m: Vector
    radius_m: float
    half_length_m: float


Solid = Box | Cylinder


@dataclass(frozen=True)
class Gripper:
    """Two parallel fingers, open."""

    name: str
    opening_m: float
    flange_to_tool_m: float
    finger_thickness_m: float
    finger_half_width_m: float
    finger_length_m: float
    """Above the tip."""
    pad_half_width_m: float
    pad_length_m: float
    tip_below_tool_m: float
    palm_half_m: Vector
    palm_above_tool_m: float
    """Of its lower face."""

    @property
    def flange_T_tool(self) -> Array:
        """(4, 4) m."""
        return se3.make(np.eye(3), [0.0, 0.0, self.flange_to_tool_m])

    def solids(self) -> tuple[Solid, ...]:
        """Palm and open fingers in the tool frame."""
        x = (self.opening_m + self.finger_thickness_m) / 2
        z = self.tip_below_tool_m - self.finger_length_m / 2
        half = self.finger_thickness_m / 2, self.finger_half_width_m, self.finger_length_m / 2
        palm_z = -self.palm_above_tool_m - self.palm_half_m[2]
        return (
            Box("palm", (0.0, 0.0, palm_z), self.palm_half_m),
            Box("left finger", (-x, 0.0, z), half),
            Box("right finger", (x, 0.0, z), half),
        )

    def envelope(self) -> tuple[Sphere, ...]:
        """Balls that together cover palm and open fingers, in the flange frame; what the fingers hold is not in it."""
        balls = []
        for solid in self.solids():
            assert isinstance(solid, Box)
            cells = np.ceil(2 * np.array(solid.half_m) / min(solid.half_m)).astype(int)
            half = np.array(solid.half_m) / cells
            for index in np.ndindex(*cells):
                centre = np.array(solid.centre_m) - solid.half_m + (2 * np.array(index) + 1) * half
                in_flange = _vector(centre + self.flange_T_tool[:3, 3])
                balls.append(Sphere(in_flange, float(np.linalg.norm(half))))
        return tuple(balls)


GRIPPERS = {
    gripper.name: gripper
    for gripper in (
        Gripper(
            "robotiq_2f_85",
            opening_m=0.085,
            flange_to_tool_m=0.130,
            finger_thickness_m=0.031,
            finger_half_width_m=0.0136,
            finger_length_m=0.104,
            pad_half_width_m=0.011,
            pad_length_m=0.0375,
            tip_below_tool_m=0.0191,
            palm_half_m=(0.0425, 0.0375, 0.045),
            palm_above_tool_m=0.040,
        ),
        Gripper(
            "rg2",
            opening_m=0.110,
            flange_to_tool_m=0.190,
            finger_thickness_m=0.016,
            finger_half_width_m=0.012,
            finger_length_m=0.110,
            pad_half_width_m=0.010,
            pad_length_m=0.030,
            tip_below_tool_m=0.0191,
            palm_half_m=(0.036, 0.030, 0.060),
            palm_above_tool_m=0.070,
        ),
    )
}
"""The grippers by name; the Robotiq's sizes are measured on its open meshes, the RG2's are rounded ones."""

PEG_RADIUS_M = 0.010
PEG_BELOW_TOOL_M = 0.080
CLEARANCE_M = 0.002

TAG = AprilTagTarget("tag36h11", 0, 0.12)
PLATE_HALF_M = (0.075, 0.075, 0.002)
BLOCK_HALF_M = (0.020, 0.020, 0.030)
BLOCK_CENTRE_M = (0.0, -0.160, 0.030)
HOLE_DEPTH_M = 0.050
HOLE_BLOCK_HALF_M = (0.040, 0.040, 0.030)
MOUTH_M = (0.0, 0.160, 0.060)


def peg() -> Cylinder:
    """The peg in the tool frame, held between the pads."""
    return Cylinder("peg", (0.0, 0.0, PEG_BELOW_TOOL_M / 2), PEG_RADIUS_M, PEG_BELOW_TOOL_M / 2)


def workpiece_T_tag() -> Array:
    """(4, 4) m: x right, y down, z into the plate, seen from the front."""
    c, s = np.cos(_PLATE_TILT_RAD), np.sin(_PLATE_TILT_RAD)
    return se3.make([[0, s, -c], [1, 0, 0], [0, -c, -s]], [0.0, 0.0, 0.065])


def workpiece(clearance_m: float) -> tuple[Solid, ...]:
    """All solids of the workpiece in its own frame; the hole's wall is a ring of flat pieces."""
    tag = workpiece_T_tag()
    plate = tag[:3, 3] + PLATE_HALF_M[2] * tag[:3, 2]
    rotvec = se3.so3_log(tag[:3, :3])
    radius = PEG_RADIUS_M + clearance_m
    mouth_x, mouth_y, top = MOUTH_M
    floor = top - HOLE_DEPTH_M
    thickness = HOLE_BLOCK_HALF_M[0] - radius
    wall = []
    for k in range(_WALL_PIECES):
        angle = 2 * np.pi * k / _WALL_PIECES
        reach = radius + thickness / 2
        centre = (mouth_x + reach * np.cos(angle), mouth_y + reach * np.sin(angle), (top + floor) / 2)
        half = thickness / 2, (radius + thickness) * np.tan(np.pi / _WALL_PIECES), HOLE_DEPTH_M / 2
        wall.append(Box(f"hole wall {k}", _vector(centre), _vector(half), (0.0, 0.0, float(angle))))
    bottom_half = (*HOLE_BLOCK_HALF_M[:2], floor / 2)
    return (
        Box("tag plate", _vector(plate), PLATE_HALF_M, _vector(rotvec)),
        Box("block", BLOCK_CENTRE_M, BLOCK_HALF_M),
        Box("hole bottom", (mouth_x, mouth_y, floor / 2), bottom_half),
        *wall,
    )


def _vector(values: Array | tuple[float, ...]) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z
