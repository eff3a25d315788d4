"""A grasp with dynamics, as a demonstration: the gripper descends, closes with a force and lifts the block.

The score of a trial is the contact sweep's: near the margins dynamics depend on the time step and on the version of
MuJoCo, geometry does not.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hecbench import se3
from hecbench.se3 import Array
from hecbench_hardware.trials import solids
from hecbench_hardware.trials.solids import Box, Gripper
from hecbench_hardware.trials.sweep import add_solid
from hecbench_hardware.trials.tasks import Verdict

_STEP_S = 0.002
_DOWN_S, _CLOSE_S, _UP_S, _HOLD_S = 0.8, 0.4, 0.8, 0.2
_FORCE_N = 40.0
_FINGER_N_M, _FINGER_DAMPING = 4000.0, 40.0
_ARM_N_M, _ARM_DAMPING = 1e5, 2e3
_BLOCK_KG, _HAND_KG, _FINGER_KG = 0.15, 1.0, 0.1
_FRICTION = (1.0, 0.01, 0.001)
_LEAST_LIFT_M = 0.08


def lift(workpiece_T_tool: Array, gripper: Gripper) -> Verdict:
    """Whether the block hangs in the gripper after the lift.

    Args:
        workpiece_T_tool: (N, 4, 4) m, the straight stroke along the tool's axis; the lift goes back along it.
        gripper: Which closes.

    Returns:
        The verdict; the margin is how much higher the block was lifted than it had to be.
    """
    import mujoco

    model = _model(gripper, workpiece_T_tool[0])
    data = mujoco.MjData(model)
    length_m = float(se3.translation_error_m(workpiece_T_tool[0], workpiece_T_tool[-1]))
    duration = _DOWN_S + _CLOSE_S + _UP_S + _HOLD_S
    for step in range(int(duration / _STEP_S)):
        now = step * _STEP_S
        share = min(now / _DOWN_S, 1.0) - float(np.clip((now - _DOWN_S - _CLOSE_S) / _UP_S, 0.0, 1.0))
        data.ctrl[0] = share * length_m
        data.ctrl[1:] = gripper.opening_m / 2 if now > _DOWN_S else 0.0
        mujoco.mj_step(model, data)
    raised = float(data.body("block").xpos[2]) - solids.BLOCK_CENTRE_M[2]
    margin_mm = 1e3 * (raised - _LEAST_LIFT_M)
    reason = "" if margin_mm >= 0 else f"the block was lifted by {1e3 * raised:.0f} mm only"
    return Verdict(margin_mm >= 0, reason, margin_mm)


def _model(gripper: Gripper, workpiece_T_tool: Array) -> Any:
    import mujoco

    spec = mujoco.MjSpec()
    spec.option.timestep = _STEP_S
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10
    spec.worldbody.add_geom(name="table", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 1])
    for solid in solids.workpiece(solids.CLEARANCE_M):
        if solid.name == "block":
            block = spec.worldbody.add_body(name="block", pos=solid.centre_m)
            block.add_freejoint()
            geom = add_solid(block, Box("block", (0.0, 0.0, 0.0), solids.BLOCK_HALF_M), mass=_BLOCK_KG)
            geom.friction = _FRICTION
        else:
            add_solid(spec.worldbody, solid)
    hand = spec.worldbody.add_body(
        name="hand", pos=workpiece_T_tool[:3, 3], quat=se3.to_quat_wxyz(workpiece_T_tool), gravcomp=1
    )
    _driven(spec, hand, "stroke", (0.0, 0.0, 1.0), _ARM_N_M, _ARM_DAMPING)
    for solid in gripper.solids():
        if solid.name == "palm":
            add_solid(hand, solid, mass=_HAND_KG)
        else:
            _finger(spec, hand, solid)
    return spec.compile()


def _finger(spec: Any, hand: Any, solid: solids.Solid) -> None:
    """A finger that slides towards the other one, pushed with a limited force."""
    inwards = -float(np.sign(solid.centre_m[0]))
    finger = hand.add_body(name=solid.name, gravcomp=1)
    add_solid(finger, solid, mass=_FINGER_KG).friction = _FRICTION
    pusher = _driven(spec, finger, solid.name, (inwards, 0.0, 0.0), _FINGER_N_M, _FINGER_DAMPING)
    pusher.forcelimited, pusher.forcerange = True, [-_FORCE_N, _FORCE_N]


def _driven(
    spec: Any, body: Any, name: str, axis: tuple[float, float, float], stiffness: float, damping: float
) -> Any:
    """A sliding joint of a body and the actuator that pulls it to a position."""
    import mujoco

    body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis, damping=damping)
    actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    actuator.set_to_position(kp=stiffness)
    return actuator
