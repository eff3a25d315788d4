"""The two tasks: where the tool goes, and when that is a success, by formula.

Frames: `workpiece` stands on the table, `tool` lies between the finger pads (solids.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from hecbench import se3
from hecbench.se3 import Array
from hecbench_hardware.trials import solids
from hecbench_hardware.trials.solids import Gripper

LEAST_OVERLAP_M = 0.010
MOST_TURN_RAD = np.deg2rad(20.0)
LEAST_DEPTH_M = 0.020
_GRASP_HEIGHT_M = 0.040
_GRASP_STROKE_M = 0.100
_INSERTION_DEPTH_M = 0.040
_INSERTION_STROKE_M = 0.090
HALF_TURN = se3.from_rotvec([0.0, 0.0, np.pi], np.zeros(3))
"""Gripper and peg are the same after half a turn about their own axis."""
_DOWN = np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, -1]])


class Task(StrEnum):
    """What is tried."""

    GRASP = "grasp"
    INSERTION = "insertion"


@dataclass(frozen=True)
class Verdict:
    """How a trial ended: `margin_mm` is what was left of the tightest tolerance, negative when exceeded."""

    success: bool
    reason: str
    margin_mm: float


def workpiece_T_tool(task: Task) -> Array:
    """(4, 4) m: where the tool ends, pointing down."""
    if task is Task.GRASP:
        x, y, _ = solids.BLOCK_CENTRE_M
        return se3.make(_DOWN, [x, y, _GRASP_HEIGHT_M])
    x, y, z = solids.MOUTH_M
    return se3.make(_DOWN, [x, y, z - _INSERTION_DEPTH_M + solids.PEG_BELOW_TOOL_M])


def stroke_m(task: Task) -> float:
    """How far above its end the tool starts, straight along its own axis."""
    return _GRASP_STROKE_M if task is Task.GRASP else _INSERTION_STROKE_M


def above(base_T_tool: Array, distance_m: float) -> Array:
    """The tool pose (4, 4) drawn back along its own axis."""
    return np.asarray(base_T_tool @ se3.make(np.eye(3), [0.0, 0.0, -distance_m]))


def final_tolerances_mm(task: Task, workpiece_T_tool: Array, gripper: Gripper) -> dict[str, float]:
    """What is left of each tolerance at the end of the motion, apart from contacts; negative is too little."""
    if task is Task.INSERTION:
        return {"depth of the peg": 1e3 * (_peg_depth_m(workpiece_T_tool) - LEAST_DEPTH_M)}
    block_T_tool = se3.inverse(se3.make(np.eye(3), solids.BLOCK_CENTRE_M)) @ workpiece_T_tool
    tip = se3.transform_points(block_T_tool, np.array([[0.0, 0.0, gripper.tip_below_tool_m]]))[0]
    half_x, half_y, half_z = solids.BLOCK_HALF_M
    along = min(half_z - tip[2], gripper.pad_length_m)
    across_offset = abs(se3.inverse(block_T_tool)[1, 3])
    across = min(half_y + gripper.pad_half_width_m - across_offset, 2 * gripper.pad_half_width_m)
    between = gripper.opening_m / 2 + half_x - abs(se3.inverse(block_T_tool)[0, 3])
    turns = np.stack([_DOWN.T, HALF_TURN[:3, :3] @ _DOWN.T]) @ block_T_tool[:3, :3]
    turn_rad = float(se3.rotation_angle(turns).min())
    tolerances = {
        "overlap along the fingers": 1e3 * (along - LEAST_OVERLAP_M),
        "overlap across the fingers": 1e3 * (across - LEAST_OVERLAP_M),
        "block between the fingers": 1e3 * between,
    }
    if turn_rad > MOST_TURN_RAD:
        tolerances["turn from the faces"] = 1e3 * half_y * (MOST_TURN_RAD - turn_rad)
    return tolerances


def closed_form(
    task: Task, workpiece_T_tool: Array, gripper: Gripper, clearance_m: float = solids.CLEARANCE_M
) -> Verdict:
    """The verdict by formula, for translations and small rotations away from the planned pose.

    Insertion: the axis of the peg must pass mouth and tip within the clearance, the tip end above the floor
    and deep enough. Grasp: the block must fit between the fingers, the tips end above the table and the palm
    above the block, and the pads overlap it.
    """
    tolerances = final_tolerances_mm(task, workpiece_T_tool, gripper)
    tool = np.array([[0.0, 0, 0], [0, 0, solids.PEG_BELOW_TOOL_M], [0, 0, gripper.tip_below_tool_m]])
    origin, peg_tip, finger_tip = se3.transform_points(workpiece_T_tool, tool)
    if task is Task.INSERTION:
        axis = workpiece_T_tool[:3, 2]
        mouth = np.array(solids.MOUTH_M)
        at_mouth = peg_tip + axis * (mouth[2] - peg_tip[2]) / axis[2]
        offset = max(float(np.linalg.norm((point - mouth)[:2])) for point in (at_mouth, peg_tip))
        widening = solids.PEG_RADIUS_M * (1 / abs(axis[2]) - 1)
        tolerances["clearance in the hole"] = 1e3 * (clearance_m - offset - widening)
        tolerances["floor of the hole"] = 1e3 * (solids.HOLE_DEPTH_M - _peg_depth_m(workpiece_T_tool))
    else:
        tool_T_block = se3.inverse(workpiece_T_tool) @ se3.make(np.eye(3), solids.BLOCK_CENTRE_M)
        yaw = float(np.arctan(tool_T_block[1, 0] / tool_T_block[0, 0]))
        width = solids.BLOCK_HALF_M[0] / np.cos(yaw) + gripper.finger_half_width_m * abs(np.tan(yaw))
        beside = gripper.opening_m / 2 - abs(float(tool_T_block[0, 3])) - width
        tolerances["room between the fingers"] = 1e3 * beside
        tolerances["tips above the table"] = 1e3 * float(finger_tip[2])
        block_top = solids.BLOCK_CENTRE_M[2] + solids.BLOCK_HALF_M[2]
        tolerances["palm above the block"] = 1e3 * (origin[2] + gripper.palm_above_tool_m - block_top)
    return verdict(tolerances)


def verdict(tolerances_mm: dict[str, float]) -> Verdict:
    """Success when every tolerance is kept; the reason names the tightest."""
    name = min(tolerances_mm, key=lambda key: tolerances_mm[key])
    left = float(tolerances_mm[name])
    return Verdict(left >= 0, "" if left >= 0 else f"{name}: {-left:.1f} mm too far", left)


def _peg_depth_m(workpiece_T_tool: Array) -> float:
    tip = se3.transform_points(workpiece_T_tool, np.array([[0.0, 0.0, solids.PEG_BELOW_TOOL_M]]))[0]
    return float(solids.MOUTH_M[2] - tip[2])
