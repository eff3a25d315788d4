"""Force mode of the simulated arm, as an admittance: along a compliant axis the tool moves towards its force.

The real controller's loop is not published; this one has no inertia, reaches the asked force against the contact
plane, and moves at a speed proportional to it in free space.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hecbench.se3 import Array
from hecbench_hardware.controller_sim.arm import CONTACT_STIFFNESS_N_M, SimulatedArm

_GAIN_M_S_N = 0.002
_GAIN_RAD_S_NM = 0.05
_STABLE_SHARE = 0.5
"""Largest share of a contact force that one cycle may take away."""


@dataclass(frozen=True)
class ForceTask:
    """What force mode was asked for, with vectors (6,) in the task frame, forces before torques."""

    base_R_task: Array
    compliant: Array
    wrench: Array
    limits: Array
    """Top speed of each compliant axis, m/s and rad/s."""

    def step(self, arm: SimulatedArm) -> None:
        """Move the arm by one cycle."""
        gain = min(_GAIN_M_S_N, _STABLE_SHARE / (CONTACT_STIFFNESS_N_M * arm.dt_s))
        gains = np.repeat([gain, min(_GAIN_RAD_S_NM, _STABLE_SHARE / arm.dt_s)], 3)
        felt = np.concatenate([self.base_R_task.T @ arm.wrench[:3], self.base_R_task.T @ arm.wrench[3:]])
        speeds = np.clip(gains * (self.wrench + felt), -np.abs(self.limits), np.abs(self.limits))
        speeds = np.where(self.compliant, speeds, 0.0)
        arm.drift(np.concatenate([self.base_R_task @ speeds[:3], self.base_R_task @ speeds[3:]]))
