"""Jin, Yu, Chen, Li 2024, "Hand-eye parameter estimation based on 3D observation of a single marker" (TIM).

Of each sample only the position of one point is used: p in the camera frame, which an unknown point m of the
other frame reaches through the hand pose (R_i, t_i). Minimises ``sum |R p_i + t - t_i - R_i m|^2`` over R, t
and m, the transform (R, t) = parent_T_camera. Nothing asks for the orientation of the target, so that planar
flips do no harm.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hecbench import se3
from hecbench.errors import Refusal, SolverFailure
from hecbench.estimate import Estimate, Termination
from hecbench.recording import Recording
from hecbench.samples.agreement import LARGEST_SHARE, percent, share_left
from hecbench.se3 import Array
from hecbench.system.wording import significant
from hecbench_plugins.markers.hand_eye import posed_samples, rotation_diversity_deg
from hecbench_plugins.markers.settings import HAND_EYE, SINGLE3D, Single3dSettings


@dataclass(frozen=True, eq=False)
class MarkerPositions:
    """The samples as this method sees them.

    Attributes:
        hand: H (N, 4, 4) m.
        points_c: marker positions (N, 3) m in the camera frame.
    """

    hand: Array
    points_c: Array

    @cached_property
    def eliminated(self) -> Eliminated:
        """The sums that remain once t and m are expressed by R."""
        return _eliminate(self.hand[:, :3, :3], self.hand[:, :3, 3], self.points_c)

    def rest_given(self, rotation: Array) -> tuple[Array, Array]:
        """parent_T_camera (4, 4) and the marker (3,) m in the other frame, optimal for a rotation (3, 3)."""
        e = self.eliminated
        marker = np.linalg.solve(e.M, e.P.T @ _vec(rotation) - e.T)
        hand_mean, points_mean = self.hand.mean(0), self.points_c.mean(0)
        translation = hand_mean[:3, 3] - rotation @ points_mean + hand_mean[:3, :3] @ marker
        return se3.make(rotation, translation), np.asarray(marker)

    def residuals_m(self, parent_T_camera: Array, marker: Array) -> Array:
        """(N, 3) m."""
        through_camera = self.points_c @ parent_T_camera[:3, :3].T + parent_T_camera[:3, 3]
        return np.asarray(through_camera - (self.hand[:, :3, :3] @ marker + self.hand[:, :3, 3]))


@dataclass(frozen=True, eq=False)
class Eliminated:
    """Sums over the centred samples; all `vec` are column by column.

    The cost as a function of R alone is ``vec(R)^T A vec(R) - 2 b^T vec(R)`` and a constant.

    Attributes:
        M: sum R_i^T R_i (3, 3).
        P: sum kron(p_i, R_i) (9, 3).
        T: sum R_i^T t_i (3,).
        A: kron(sum p_i p_i^T, I) - P M^-1 P^T (9, 9).
        b: vec(sum t_i p_i^T) - P M^-1 T (9,).
    """

    M: Array
    P: Array
    T: Array
    A: Array
    b: Array


def _eliminate(rotations: Array, translations: Array, points: Array) -> Eliminated:
    R, t, p = rotations - rotations.mean(0), translations - translations.mean(0), points - points.mean(0)
    M = np.einsum("nki,nkj->ij", R, R)
    P = np.einsum("na,nij->aij", p, R).reshape(9, 3)
    T = np.einsum("nki,nk->i", R, t)
    A = np.kron(p.T @ p, np.eye(3)) - P @ np.linalg.solve(M, P.T)
    return Eliminated(M, P, T, A, _vec(t.T @ p) - P @ np.linalg.solve(M, T))


def _vec(matrix: Array) -> Array:
    return np.asarray(matrix.T.reshape(-1))


def marker_positions(recording: Recording) -> MarkerPositions:
    """The samples with a hand pose and a target pose; the marker is the centroid of the target's points.

    Raises:
        Refusal: fewer than 3 samples, or the hand does not rotate about two axes.
    """
    chosen, camera_T_target = posed_samples(recording)
    marker = np.zeros(3) if recording.target is None else recording.target.points_m.mean(0)
    some = chosen[:: 1 + len(chosen) // SINGLE3D.most_compared, :3, :3]
    i, j = np.triu_indices(len(some), 1)
    logs = se3.so3_log(np.swapaxes(some[i], 1, 2) @ some[j])
    diversity_deg = rotation_diversity_deg(logs)
    if diversity_deg[1] < HAND_EYE.least_rotation_deg:
        raise Refusal(
            f"the hand rotates by {significant(diversity_deg[0], 3)} deg rms about one axis and "
            f"{significant(diversity_deg[1])} "
            "about any other: add samples turned by 20 deg or more about a second axis"
        )
    return MarkerPositions(chosen, se3.transform_points(camera_T_target, marker[None])[:, 0])


def closed_form(positions: MarkerPositions, *, reference_projection: bool = False) -> Array:
    """R (3, 3): the 9x9 linear system without orthogonality, then projected onto the rotations.

    `reference_projection` multiplies by the sign of the determinant, as the authors' code does, instead of
    taking the nearest rotation.
    """
    e = positions.eliminated
    free = np.linalg.lstsq(e.A, e.b, rcond=None)[0].reshape(3, 3).T
    if reference_projection:
        u, _, vt = np.linalg.svd(free)
        return np.asarray(np.linalg.det(u @ vt) * (u @ vt))
    return se3.nearest_rotation(free)


def iterate(positions: MarkerPositions) -> tuple[Array, int]:
    """R (3, 3) at the minimum, and the iterations.

    Gauss-Newton from the closed form and from the best of the 24 rotations of a cube: where the closed form
    is useless, the second start is not.
    """
    from scipy.spatial.transform import Rotation

    e = positions.eliminated
    cube = Rotation.create_group("O").as_matrix()
    best_cube = min(cube, key=lambda rotation: _cost(e, rotation))
    found = [_descend(e, start) for start in (closed_form(positions), best_cube)]
    rotation, iterations = min(found, key=lambda result: _cost(e, result[0]))
    return rotation, iterations


def _cost(e: Eliminated, rotation: Array) -> float:
    """The cost of a rotation (3, 3) without its constant, m^2."""
    columns = _vec(rotation)
    return float(columns @ e.A @ columns - 2 * e.b @ columns)


def _descend(e: Eliminated, rotation: Array, settings: Single3dSettings = SINGLE3D) -> tuple[Array, int]:
    """Gauss-Newton from a start; a step that would raise the cost, beyond rounding, is halved."""
    for iteration in range(1, settings.iterations + 1):
        F = np.stack([_vec(rotation @ generator) for generator in se3.hat(np.eye(3))], 1)
        step = np.linalg.lstsq(F.T @ e.A @ F, F.T @ (e.b - e.A @ _vec(rotation)), rcond=None)[0]
        here = _cost(e, rotation)
        while _cost(e, rotation @ se3.so3_exp(step)) > here + settings.rounding * abs(here):
            step = step / 2
        rotation = se3.nearest_rotation(rotation @ se3.so3_exp(step))
        if np.linalg.norm(step) < settings.least_step_rad:
            return rotation, iteration
    return rotation, settings.iterations


def to_estimate(
    positions: MarkerPositions, rotation: Array, termination: Termination, iterations: int = 0
) -> Estimate:
    """The estimate with its evidence: the rms distance left, and how far from coplanar the positions are.

    Raises:
        SolverFailure: it contradicts the samples.
    """
    parent_T_camera, marker = positions.rest_given(rotation)
    residuals_m = positions.residuals_m(parent_T_camera, marker)
    left_m = _rms(residuals_m)
    moved_m = np.linalg.norm(positions.points_c - positions.points_c.mean(0), axis=1)
    if (share := share_left(np.linalg.norm(residuals_m, axis=1), moved_m)) > LARGEST_SHARE:
        raise SolverFailure(
            f"leaves the typical marker {percent(share)} of its own motion away from where it was seen: "
            "are the robot poses inverted, or the mounting wrong?"
        )
    condition = float(np.linalg.cond(positions.eliminated.A))
    diagnostics = {
        "samples": len(positions.hand),
        "position_rms_mm": 1e3 * left_m,
        "coplanarity_condition": condition,
        "nearly_coplanar": condition > SINGLE3D.coplanar_condition,
    }
    return Estimate(
        parent_T_camera,
        termination=termination,
        iterations=iterations,
        diagnostics=diagnostics,
        extras={"marker_in_other_m": marker.tolist()},
    )


def _rms(vectors: Array) -> float:
    return float(np.sqrt((vectors**2).sum(1).mean()))
