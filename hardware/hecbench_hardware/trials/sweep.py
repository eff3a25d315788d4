"""The contact sweep: gripper and peg moved along a path past the workpiece; any contact is a failure.

Everything is expressed in the workpiece's frame, so that only the gripper moves. MuJoCo answers which solids
are how far apart; no dynamics and no graphics take part.
"""

from __future__ import annotations

import itertools
from functools import lru_cache
from typing import Any

import numpy as np

from hecbench import se3
from hecbench.se3 import Array
from hecbench_hardware.trials import solids
from hecbench_hardware.trials.solids import Box, Gripper, Solid
from hecbench_hardware.trials.tasks import Task, Verdict, final_tolerances_mm, verdict

_STEP_M = 0.005
_NEAR_M = {Task.GRASP: 0.03, Task.INSERTION: 0.006}
"""Distances up to this are measured; beyond it the margin is this."""


def judge(
    task: Task, workpiece_T_tool: Array, gripper: Gripper, clearance_m: float = solids.CLEARANCE_M
) -> Verdict:
    """The verdict on a path of tool poses (N, 4, 4) m, first to last, in the frame of the workpiece.

    The path's last pose is where the fingers close or the peg rests.
    """
    return _Sweep.of(task, gripper, clearance_m).judge(workpiece_T_tool)


def densified(path: Array) -> Array:
    """Poses (M, 4, 4) along a path (N, 4, 4), no two further apart than the step of the sweep."""
    pieces = [path[:1]]
    for start, end in itertools.pairwise(path):
        count = int(np.ceil(np.linalg.norm(end[:3, 3] - start[:3, 3]) / _STEP_M)) or 1
        twist = se3.log(se3.inverse(start) @ end)
        pieces.append(start @ se3.exp(np.linspace(0, 1, count + 1)[1:, None] * twist))
    return np.concatenate(pieces)


class _Sweep:
    """One MuJoCo model of solids, made once for each task, gripper and clearance."""

    @staticmethod
    @lru_cache(maxsize=16)
    def of(task: Task, gripper: Gripper, clearance_m: float) -> _Sweep:
        return _Sweep(task, gripper, clearance_m)

    def __init__(self, task: Task, gripper: Gripper, clearance_m: float) -> None:
        import mujoco

        self.task, self.gripper, self.near_m = task, gripper, _NEAR_M[task]
        spec = mujoco.MjSpec()
        table = spec.worldbody.add_geom(name="table", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 1])
        table.margin = self.near_m
        for solid in solids.workpiece(clearance_m):
            add_solid(spec.worldbody, solid, margin=self.near_m)
        body = spec.worldbody.add_body(name="tool")
        body.add_freejoint()  # bodies that cannot move are not tested against each other
        moving = (*gripper.solids(), *((solids.peg(),) if task is Task.INSERTION else ()))
        for solid in moving:
            add_solid(body, solid)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.names = [self.model.geom(i).name for i in range(self.model.ngeom)]

    def judge(self, workpiece_T_tool: Array) -> Verdict:
        nearest, pair, where = self._nearest(densified(workpiece_T_tool))
        tolerances = final_tolerances_mm(self.task, workpiece_T_tool[-1], self.gripper)
        final = verdict(tolerances)
        if nearest >= 0:
            return Verdict(final.success, final.reason, min(final.margin_mm, 1e3 * nearest))
        what = f"{pair[1]} touches {pair[0]} at {where:.0%} of the way, {-1e3 * nearest:.1f} mm deep"
        return Verdict(False, what, min(final.margin_mm, 1e3 * nearest))

    def _nearest(self, path: Array) -> tuple[float, tuple[str, str], float]:
        """The smallest distance m on the path, negative in contact, of which pair and how far on the way.

        A contact is reported where it begins, its depth is the largest.
        """
        import mujoco

        model, data = self.model, self.data
        quaternions = se3.to_quat_wxyz(path)
        nearest, pair, where = self.near_m, ("", ""), 0.0
        for step, (pose, quaternion) in enumerate(zip(path, quaternions, strict=True)):
            data.qpos[:3], data.qpos[3:] = pose[:3, 3], quaternion
            mujoco.mj_kinematics(model, data)
            mujoco.mj_collision(model, data)
            if not data.ncon:
                continue
            distances = data.contact.dist
            k = int(distances.argmin())
            if distances[k] < nearest:
                if nearest >= 0:
                    first, second = (self.names[i] for i in sorted(data.contact.geom[k]))
                    pair, where = (first, second), step / max(len(path) - 1, 1)
                nearest = float(distances[k])
        return nearest, pair, where


def add_solid(body: Any, solid: Solid, **settings: Any) -> Any:
    """Add a solid to a body of a MuJoCo specification."""
    import mujoco

    if isinstance(solid, Box):
        quaternion = se3.to_quat_wxyz(se3.from_rotvec(solid.rotvec, np.zeros(3)))
        kind, size = mujoco.mjtGeom.mjGEOM_BOX, solid.half_m
    else:
        quaternion = np.array([1.0, 0, 0, 0])
        kind, size = mujoco.mjtGeom.mjGEOM_CYLINDER, (solid.radius_m, solid.half_length_m, 0.0)
    return body.add_geom(
        name=solid.name, type=kind, size=size, pos=solid.centre_m, quat=quaternion, **settings
    )
