"""After Wang, Sun, Liu, Song 2024, "Dual quaternion operations for rigid body motion and their application to
the hand-eye calibration" (MMT 193:105566); reconstructed from its abstract and follow-ups, not from its text.

The dual-quaternion equation ``a x = x b`` is written with 8x8 matrices that keep the scalar rows which
Daniilidis drops: equal on exact data, another weighting of noise.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from hecbench.errors import Refusal
from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import Need, SolverSpec
from hecbench_plugins.markers import dual_quaternions
from hecbench_plugins.markers.hand_eye import (
    PosedSamples,
    pose_pairs,
    rotation_diversity_deg,
    to_estimate,
)
from hecbench_plugins.markers.settings import HAND_EYE

_ITERATIONS = 50
"""Of the descent, at most."""
_CONVERGED_STEP = 1e-12
"""Length of a step, in units of the dual quaternion."""


class Method(StrEnum):
    """How the stacked equations are solved."""

    NULL_SPACE = "nullspace"
    QCQP = "qcqp"


@dataclass(frozen=True)
class Wang2024:
    """Null space of the stacked 8x8 blocks, or their least squares over all unit dual quaternions.

    Attributes:
        method: `nullspace`, closed form, or `qcqp`, the minimum over all unit dual quaternions (the cost of
            Horn, Wodtko et al. 2023).
    """

    method: Method = Method.NULL_SPACE

    def __call__(self, recording: Recording, *, rng: np.random.Generator) -> Estimate:
        """Answer.

        Raises:
            Refusal: too few samples, or the hand does not rotate about two axes.
        """
        pairs = pose_pairs(recording)
        A, B = _without_half_turns(pairs)
        equations = dual_quaternions.motion_equations(A, B).reshape(-1, 8)
        singular_values, vectors = np.linalg.svd(equations, full_matrices=False)[1:]
        if self.method is Method.NULL_SPACE:
            real, dual = dual_quaternions.unit_combination(vectors[6], vectors[7])
        else:
            real, dual = _least_squares(equations.T @ equations)
        diagnostics = {
            "method": str(self.method),
            "pairs_used": len(A),
            "pairs": len(pairs.motions[0]),
            "null_space_gap": float(singular_values[5] / max(singular_values[6], 1e-300)),
        }
        return to_estimate(pairs, dual_quaternions.to_transform(real, dual), diagnostics=diagnostics)


def _without_half_turns(pairs: PosedSamples) -> tuple[Array, Array]:
    """The motions whose quaternions have a sign that noise cannot turn: it vanishes at 180 deg.

    Raises:
        Refusal: the rest does not rotate about two axes.
    """
    A, B = pairs.motions
    angles_deg = np.rad2deg(np.linalg.norm(pairs.rotation_logs, axis=-1))
    margin_deg = max(1.0, 6.0 * float(np.median(np.abs(angles_deg[0] - angles_deg[1]))))
    kept = angles_deg.max(0) < 180.0 - margin_deg
    if (
        not kept.any()
        or rotation_diversity_deg(pairs.rotation_logs[0][kept])[1:2].sum() < HAND_EYE.least_rotation_deg
    ):
        raise Refusal(
            f"{(~kept).sum()} of {len(kept)} motions are half a turn, where quaternions lose their sign, and "
            "the others do not rotate about two axes: add samples tilted by 20 to 60 deg"
        )
    return A[kept], B[kept]


def _least_squares(Q: Array) -> tuple[Array, Array]:
    """The unit dual quaternion z that minimises ``z^T Q z``: Gauss-Newton on the manifold, four starts."""
    starts = np.linalg.eigh(Q[:4, :4])[1].T
    found = [_descend(Q, np.concatenate([real, _best_dual(Q, real)])) for real in starts]
    best = min(found, key=lambda z: float(z @ Q @ z))
    return best[:4], best[4:]


def _best_dual(Q: Array, real: Array) -> Array:
    """x' (4,) orthogonal to a unit x (4,) that minimises the form; Q22 itself is singular on exact data."""
    system = np.zeros((5, 5))
    system[:4, :4], system[:4, 4], system[4, :4] = Q[4:, 4:], real, real
    return np.asarray(np.linalg.lstsq(system, np.append(-Q[4:, :4] @ real, 0.0), rcond=None)[0][:4])


def _descend(Q: Array, z: Array) -> Array:
    for _ in range(_ITERATIONS):
        real, dual = dual_quaternions.left_matrix(z[:4])[:, 1:], dual_quaternions.left_matrix(z[4:])[:, 1:]
        tangent = np.block([[real, np.zeros((4, 3))], [dual, real]])
        step = -np.linalg.lstsq(tangent.T @ Q @ tangent, tangent.T @ Q @ z, rcond=None)[0]
        candidate = z + tangent @ step
        candidate /= np.linalg.norm(candidate[:4])
        candidate[4:] -= (candidate[:4] @ candidate[4:]) * candidate[:4]
        if candidate @ Q @ candidate > z @ Q @ z:
            break
        z = candidate
        if np.linalg.norm(step) < _CONVERGED_STEP:
            break
    return z


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's solver."""
    yield SolverSpec(
        name="wang2024_reconstructed",
        summary="AX = XB, simultaneous, dual quaternions with 8x8 matrices",
        factory=Wang2024,
        needs=frozenset({Need.TARGET_POSES}),
        reference="after Wang, Sun, Liu, Song 2024, MMT 193:105566",
    )
