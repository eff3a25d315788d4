"""One camera pose from keypoints in many pictures: RANSAC over all of them, refinement, and a covariance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import SolverFailure
from hecbench.se3 import Array
from hecbench_plugins.perception.settings import POSE

REFERENCE_WIDTH_PX = 640


class Sightings(NamedTuple):
    """N keypoints that were seen.

    Attributes:
        points: (N, 3) m in the parent's frame.
        rays: (N, 2), x / z and y / z of their pixels without the lens.
        keypoint: (N,) that each is.
        cluster: (N,) whose errors depend on each other: those of one view, unless `independent` found others.
        weight: (N,) in [0, 1].
    """

    points: Array
    rays: Array
    keypoint: NDArray[np.int64]
    cluster: NDArray[np.int64]
    weight: Array

    def select(self, which: NDArray[np.bool_]) -> Sightings:
        """Only these."""
        return Sightings._make(values[which] for values in self)


def independent(seen: Sightings) -> Sightings:
    """The sightings with weights and clusters that count a point which stands still once.

    Where a keypoint does not move between views (the robot's base before a fixed camera), the network sees the same
    picture of it again, and errs in the same way: n such sightings share the weight of one and are one cluster.
    """
    apart = np.linalg.norm(seen.points[:, None] - seen.points[None], axis=2)
    same = (apart < POSE.still_m) & (seen.keypoint[:, None] == seen.keypoint[None])
    count = same.sum(1)
    first = same.argmax(1)
    cluster = np.where(count > 1, -1 - first, seen.cluster)
    return seen._replace(cluster=cluster, weight=seen.weight / count)


@dataclass(frozen=True, eq=False)
class KeypointPose:
    """The answer: parent_T_camera (4, 4), its covariance (6, 6) of a left perturbation [rad, m], and what agreed.

    Attributes:
        inliers: (N,) which sightings lie within the limit.
        rms: of the inliers' reprojection, in units of focal length.
    """

    parent_T_camera: Array
    covariance: Array
    inliers: NDArray[np.bool_]
    rms: float


def consensus(seen: Sightings, limit: float, rounds: int, rng: np.random.Generator) -> Array:
    """camera_T_parent (4, 4) that the most sightings agree with, to `limit` in units of focal length.

    Fischler and Bolles 1981, with the solution of 4 points by Lambda twist's P3P of OpenCV's choice (AP3P, Ke and
    Roumeliotis 2017), the fourth deciding between its answers.

    Raises:
        SolverFailure: no four points have a pose.
    """
    import cv2

    best, best_score = None, -1.0
    for _ in range(rounds):
        chosen = rng.choice(len(seen.points), POSE.minimal_points, replace=False)
        ok, rotation, translation = cv2.solvePnP(
            seen.points[chosen], seen.rays[chosen], np.eye(3), None, flags=cv2.SOLVEPNP_AP3P
        )
        if not ok or not np.isfinite(translation).all():
            continue
        camera_T_parent = se3.from_rotvec(rotation.ravel(), translation.ravel())
        near = _apart(seen, camera_T_parent) < limit
        score = float(seen.weight[near].sum())
        if score > best_score:
            best, best_score = camera_T_parent, score
    if best is None:
        raise SolverFailure("no four of the trusted keypoints have a common camera pose")
    return best


def refined(seen: Sightings, camera_T_parent: Array, limit: float) -> KeypointPose:
    """The pose of least robust reprojection error of those that agree, found twice as they are chosen anew.

    The covariance is the sandwich (Huber 1967) with clusters of one view: the errors within a picture are not
    independent. A keypoint that is off in the same way in all views is not in it.
    """
    from scipy.optimize import least_squares

    parent_T_camera = se3.inverse(camera_T_parent)
    scale = limit * POSE.robust
    for _ in range(POSE.refinements):
        agree = _apart(seen, se3.inverse(parent_T_camera)) < limit
        kept, start = seen.select(agree), parent_T_camera

        def residuals(twist: Array, kept: Sightings = kept, start: Array = start) -> Array:
            camera_T_parent = se3.inverse(se3.exp(twist) @ start)
            off = _projected(kept.points, camera_T_parent) - kept.rays
            return np.asarray(np.sqrt(kept.weight)[:, None] * off).ravel()

        found = least_squares(residuals, np.zeros(6), loss="cauchy", f_scale=scale, x_scale="jac")
        parent_T_camera = se3.exp(found.x) @ start
    here = least_squares(residuals, found.x, max_nfev=1)  # its Jacobian is not scaled by the loss
    covariance = _sandwich(here.jac, here.fun, scale, np.repeat(kept.cluster, 2))
    inliers = _apart(seen, se3.inverse(parent_T_camera)) < limit
    rms = float(np.sqrt(2 * (here.fun**2).mean()))
    return KeypointPose(parent_T_camera, covariance, inliers, rms)


def _sandwich(J: Array, residuals: Array, scale: float, cluster: NDArray[np.int64]) -> Array:
    """Covariance (6, 6) of the least Cauchy loss of residuals (M,) with derivative J (M, 6), in clusters (M,)."""
    z = (residuals / scale) ** 2
    bread = np.linalg.pinv(np.einsum("n,nj,nk->jk", np.maximum(1 - z, 0) / (1 + z) ** 2, J, J))
    scores = J * (residuals / (1 + z))[:, None]
    clusters = np.unique(cluster)
    summed = np.stack([scores[cluster == one].sum(0) for one in clusters])
    return np.asarray(bread @ (summed.T @ summed) @ bread * (len(clusters) / max(len(clusters) - 1, 1)))


def _apart(seen: Sightings, camera_T_parent: Array) -> Array:
    """Reprojection errors (N,) in units of focal length; infinite behind the camera."""
    depth = seen.points @ camera_T_parent[2, :3] + camera_T_parent[2, 3]
    off = np.linalg.norm(_projected(seen.points, camera_T_parent) - seen.rays, axis=1)
    return np.where(depth > POSE.near_m, off, np.inf)


def _projected(points: Array, camera_T_parent: Array) -> Array:
    """(N, 2): x / z and y / z."""
    p = se3.transform_points(camera_T_parent, points)
    return np.asarray(p[:, :2] / np.maximum(p[:, 2:], POSE.near_m))
