"""Whether a motion keeps clear of the walls, all the way and not only at its samples.

Tool and arm are balls, so their distances from boxes are exact. A ball that is `a` away from a wall at one sample and
`b` at the next cannot touch it in between when it covers less than `a + b` there. Where that does not hold a sample is
put in the middle, until it holds, or until a way of a millimetre is still not clear, which is refused.

Schwarzer, Saha and Latombe 2005, "Adaptive dynamic collision checking for single and multiple articulated robots in
complex environments".
"""

from __future__ import annotations

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.se3 import Array
from hecbench_hardware.kinematics import Arm
from hecbench_hardware.limits import Box, Limits, Sphere
from hecbench_hardware.motions import JointMotion, Motion

RESOLUTION_M = 1e-3
"""The longest way of a point between two samples at which the search for a gap ends."""
_LINK_STEP_M = 0.02
_TOOL_LINE_M = 0.01
"""Radius of the thinnest tool that has a centre point."""


def check_pose(arm: Arm, joints: Array, limits: Limits) -> None:
    """Refuse joints (6,) rad at which a joint, the tool or a link is outside the limits."""
    check_motion(arm, JointMotion(arm, joints, joints), limits)


def check_motion(arm: Arm, motion: Motion, limits: Limits, slack_m: float = 0.0) -> None:
    """Refuse a motion on which a joint, the tool or a link leaves the limits anywhere on the way.

    Args:
        arm: Moves.
        motion: As the controller makes it.
        limits: Its walls, and the balls of the tool.
        slack_m: How far the real arm may be from where its nominal lengths put it.

    Raises:
        InputError: Which bound, where on the way, by how much, and the cure.
    """
    walls = _Walls(arm, limits, slack_m)
    fractions, joints = motion.fractions, motion.joints
    clear = walls.clear_m(joints)
    while True:
        _check_joints(joints, limits)
        way = np.column_stack(motion.travel(fractions, joints, walls.tool_m))
        unsure = (clear[:-1] + clear[1:] < way).any(1)
        closed = unsure & (way.max(1, initial=0.0) < RESOLUTION_M)
        if (touching := np.flatnonzero((clear < 0).any(1))).size or (touching := np.flatnonzero(closed)).size:
            raise walls.refusal(joints[touching[0]], fractions[touching[0]])
        if not unsure.any():
            return
        after = np.flatnonzero(unsure) + 1
        middles = (fractions[after - 1] + fractions[after]) / 2
        new = np.array([motion.at(middle, joints[k - 1]) for middle, k in zip(middles, after, strict=True)])
        fractions, joints = np.insert(fractions, after, middles), np.insert(joints, after, new, axis=0)
        clear = np.insert(clear, after, walls.clear_m(new), axis=0)


def tool_line(flange_T_tcp: Array) -> tuple[Sphere, ...]:
    """Balls from the flange to a tool centre point: what a tool that reaches so far covers at least."""
    points = _polyline(np.array([[np.zeros(3), flange_T_tcp[:3, 3]]]), _TOOL_LINE_M)[0]
    return tuple(Sphere((float(x), float(y), float(z)), _TOOL_LINE_M) for x, y, z in points)


def body_points(frames: Array) -> Array:
    """Points (N, P, 3) m along the links for link frames (N, 6, 4, 4), from the shoulder to the flange.

    The upper arm runs beside the shoulder's axis, by about the offset of the wrist, as on the real arms.
    """
    origins = frames[..., :3, 3]
    aside = origins[:, 3] - origins[:, 2]
    corners = [origins[:, 0], origins[:, 0] + aside, origins[:, 1] + aside, *origins.swapaxes(0, 1)[1:]]
    return _polyline(np.stack(corners, axis=1), _LINK_STEP_M)


def _polyline(corners: Array, step_m: float) -> Array:
    """Points (N, P, 3) along polylines (N, C, 3), no further apart than a step; P is that of the longest ones."""
    lengths = np.linalg.norm(np.diff(corners, axis=1), axis=2).max(0)
    points = [corners[:, :1]]
    for k, length in enumerate(lengths):
        parts = np.linspace(0, 1, int(np.ceil(length / step_m)) + 1)[1:]
        points.append(corners[:, k, None] + parts[:, None] * (corners[:, k + 1] - corners[:, k])[:, None])
    return np.concatenate(points, axis=1)


class _Walls:
    """The workspace and the boxes, and how far the balls of the tool and the arm are from them."""

    def __init__(self, arm: Arm, limits: Limits, slack_m: float) -> None:
        self._arm, self._limits = arm, limits
        self.tool_m = np.array([ball.centre_m for ball in limits.tool]).reshape(-1, 3)
        self._tool_radii_m = np.array([ball.radius_m for ball in limits.tool]) + slack_m
        # balls along a link which together cover a tube of the arm's radius
        self._arm_radius_m = float(np.hypot(limits.arm_radius_m, _LINK_STEP_M / 2)) + slack_m

    def clear_m(self, joints: Array) -> Array:
        """(N, S + 1) m from every ball of the tool, and from the arm, to the nearest wall; negative inside."""
        frames = self._arm.link_frames(joints)
        tool, body = [self._inside(frames)], [np.full(len(joints), np.inf)]
        for box in self._limits.keep_out:
            tool.append(self._tool_from(box, frames))
            body.append(self._arm_from(box, frames))
        return np.column_stack([np.min(tool, axis=0), np.min(body, axis=0)])

    def refusal(self, joints: Array, fraction: float) -> InputError:
        """The wall that is nearest at joints (6,) rad, in words."""
        frames = self._arm.link_frames(joints[None])
        found = [(self._inside(frames).min(initial=np.inf), "the tool leaves the workspace")]
        for box in self._limits.keep_out:
            what = f"the keep-out box {box.lower_m} to {box.upper_m}"
            found.append((self._tool_from(box, frames).min(initial=np.inf), f"the tool enters {what}"))
            found.append((self._arm_from(box, frames).min(), f"the arm enters {what}"))
        clear_m, what = min(found)
        depth = f"by {-clear_m:.3f} m" if clear_m < 0 else f"or is nearer than {RESOLUTION_M:.3f} m to it"
        return InputError(f"{what} at {fraction:.0%} of the way, {depth}: choose another target")

    def _inside(self, frames: Array) -> Array:
        centres, space = se3.transform_points(frames[:, 5], self.tool_m), self._limits.workspace
        inside = np.minimum(centres - np.array(space.lower_m), np.array(space.upper_m) - centres)
        return np.asarray(inside.min(axis=2) - self._tool_radii_m)

    def _tool_from(self, box: Box, frames: Array) -> Array:
        return _distance(se3.transform_points(frames[:, 5], self.tool_m), box) - self._tool_radii_m

    def _arm_from(self, box: Box, frames: Array) -> Array:
        return np.asarray(_distance(body_points(frames), box).min(1) - self._arm_radius_m)


def _check_joints(path: Array, limits: Limits) -> None:
    lower, upper = np.array(limits.joint_lower_rad), np.array(limits.joint_upper_rad)
    for row, j in np.argwhere((path < lower) | (path > upper)).tolist():
        raise InputError(
            f"joint {j + 1} at {path[row, j]:.3f} rad is outside {lower[j]:.3f} to {upper[j]:.3f} rad:"
            " choose another target, or widen the limits"
        )


def _distance(points: Array, box: Box) -> Array:
    """Distances (...,) m of points (..., 3) from a box, 0 inside."""
    outside = np.maximum(np.maximum(np.array(box.lower_m) - points, points - np.array(box.upper_m)), 0)
    return np.asarray(np.linalg.norm(outside, axis=-1))
