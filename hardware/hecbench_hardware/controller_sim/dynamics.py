"""A rigid-body estimate of joint torques: links as point masses at their centres, and the inertia of the drives.

Masses and centres: Universal Robots, article "DH parameters for calculations of kinematics and dynamics". The
inertia of the drives and their friction are guesses of the right order; there is no Coulomb friction.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from hecbench.se3 import Array
from hecbench_hardware.kinematics import UrArm

_LINKS: Final = {
    "ur3e": (
        (1.98, 3.4445, 1.437, 0.871, 0.805, 0.261),
        ((0, -0.02, 0), (0.13, 0, 0.1157), (0.05, 0, 0.0238), (0, 0, 0.01), (0, 0, 0.01), (0, 0, -0.02)),
    ),
    "ur5e": (
        (3.761, 8.058, 2.846, 1.37, 1.3, 0.365),
        (
            *((0, -0.02561, 0.00193), (0.2125, 0, 0.11336), (0.15, 0, 0.0265)),
            *((0, -0.0018, 0.01634), (0, 0.0018, 0.01634), (0, 0, -0.001159)),
        ),
    ),
    "ur10e": (
        (7.369, 13.051, 3.989, 2.1, 1.98, 0.615),
        (
            *((0.021, 0, 0.027), (0.38, 0, 0.158), (0.24, 0, 0.068)),
            *((0, 0.007, 0.018), (0, 0.007, 0.018), (0, 0, -0.026)),
        ),
    ),
}
"""Masses in kg and centres in m, in the Denavit-Hartenberg frames of the links, by arm."""
DRIVE_INERTIA_KG_M2: Final = np.array([1.0, 1.0, 0.5, 0.1, 0.1, 0.1])
VISCOUS_NM_S: Final = np.array([10.0, 10.0, 5.0, 1.0, 1.0, 1.0])
_STEP_S = 1e-6
LONGEST_STEP_S = 0.002


@dataclass(frozen=True)
class Dynamics:
    """Of an arm with a payload."""

    arm: UrArm
    payload_kg: float = 0.0
    payload_cog_m: tuple[float, ...] = (0.0, 0.0, 0.0)
    """From the flange."""

    @cached_property
    def _masses(self) -> Array:
        return np.array([*_LINKS[self.arm.name][0], self.payload_kg])

    @cached_property
    def _centres(self) -> Array:
        return np.array([*_LINKS[self.arm.name][1], self.payload_cog_m], float)

    def _jacobians(self, joints_rad: Array) -> Array:
        """Of the seven centres of mass (7, 3, 6)."""
        frames = self.arm.link_frames(joints_rad)
        axes = np.vstack([[0.0, 0.0, 1.0], frames[:5, :3, 2]])
        origins = np.vstack([np.zeros(3), frames[:5, :3, 3]])
        on = frames[[0, 1, 2, 3, 4, 5, 5]]
        centres = np.einsum("kij,kj->ki", on[:, :3, :3], self._centres) + on[:, :3, 3]
        columns = np.cross(axes[None], centres[:, None] - origins[None])
        carried = np.arange(6)[None] <= np.array([0, 1, 2, 3, 4, 5, 5])[:, None]
        return np.asarray(np.where(carried[..., None], columns, 0.0).transpose(0, 2, 1))

    def mass_matrix(self, joints_rad: ArrayLike) -> Array:
        """Inertia (6, 6) kg m^2."""
        j = self._jacobians(np.asarray(joints_rad, float))
        return np.asarray(np.einsum("k,kai,kaj->ij", self._masses, j, j) + np.diag(DRIVE_INERTIA_KG_M2))

    def coriolis(self, joints_rad: ArrayLike, joint_speeds: ArrayLike) -> Array:
        """Coriolis and centrifugal torques (6,) Nm: sum of m J' (dJ/dt) qd over the centres."""
        q, qd = np.asarray(joints_rad, float), np.asarray(joint_speeds, float)
        if not qd.any():
            return np.zeros(6)
        ahead, behind = self._jacobians(q + qd * _STEP_S), self._jacobians(q - qd * _STEP_S)
        rate = (ahead - behind) / (2 * _STEP_S)
        return np.asarray(np.einsum("k,kai,ka->i", self._masses, self._jacobians(q), rate @ qd))

    def gravity(self, joints_rad: ArrayLike, acceleration: ArrayLike) -> Array:
        """Torques (6,) Nm that hold the arm in a base that accelerates by (3,) m/s^2, upwards at rest."""
        j = self._jacobians(np.asarray(joints_rad, float))
        return np.asarray(np.einsum("k,kai,a->i", self._masses, j, np.asarray(acceleration, float)))

    def accelerate(
        self, joints_rad: Array, joint_speeds: Array, torques: Array, duration_s: float
    ) -> tuple[Array, Array]:
        """Joints and speeds (6,) after torques (6,) Nm beyond those of gravity; friction slows the joints."""
        steps = max(1, int(np.ceil(duration_s / LONGEST_STEP_S)))
        step_s, q, qd = duration_s / steps, joints_rad, joint_speeds
        for _ in range(steps):
            inertia = self.mass_matrix(q) + np.diag(VISCOUS_NM_S) * step_s
            change = torques - self.coriolis(q, qd) - VISCOUS_NM_S * qd
            qd = qd + np.linalg.solve(inertia, change) * step_s
            q = q + qd * step_s
        return q, qd
