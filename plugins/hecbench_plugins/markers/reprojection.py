"""What the reprojection solvers share: the problem, and the start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hecbench import se3
from hecbench.bundle.adjustment import Solution, adjust
from hecbench.bundle.model import Noise, Problem, State, linearise, start
from hecbench.errors import Refusal, SolverFailure
from hecbench.estimate import Estimate
from hecbench.lens import FixedSensor, Sensor, parameters_of
from hecbench.recording import Recording
from hecbench.samples.agreement import LARGEST_SHARE, share_left
from hecbench.samples.standstills import one_per_robot_pose
from hecbench.se3 import Array
from hecbench.system.wording import significant
from hecbench_plugins.markers import single3d
from hecbench_plugins.markers.hand_eye import pose_pairs
from hecbench_plugins.markers.opencv_hand_eye import robot_world
from hecbench_plugins.markers.settings import ADJUSTMENT_STARTS
from hecbench_plugins.markers.target_poses import planar_candidates

DEFAULT_NOISE = Noise(0.3, float(np.deg2rad(0.05)), 5e-4)
"""A corner, and a good arm: px, rad, m."""


def corner_problem(recording: Recording, prior_sigmas: Array | None = None) -> Problem:
    """The samples with a robot pose and target points, one per robot pose.

    With `prior_sigmas` (4 + D,) the intrinsics are unknowns.

    Raises:
        Refusal: no corners, intrinsics or robot poses, or the samples do not determine X.
    """
    pose_pairs(recording)
    recording = one_per_robot_pose(recording)
    camera, target, corners_px = recording.camera, recording.target, recording.corners_px
    if camera is None or camera.K is None or target is None or corners_px is None:
        raise Refusal("needs corners_px, target and camera.K")
    usable = np.isfinite(recording.present.base_T_flange).all((1, 2)) & np.isfinite(corners_px).any((1, 2))
    problem = Problem(
        recording.mounting,
        recording.present.base_T_flange[usable],
        target.points_m,
        corners_px[usable],
        FixedSensor(camera),
    )
    if prior_sigmas is None:
        return problem
    return replace(
        problem,
        sensor=Sensor(camera.distortion_model),
        parameters=parameters_of(camera),
        parameter_sigmas=prior_sigmas,
    )


def adjust_with_exact_robot(recording: Recording, problem: Problem) -> Solution:
    """The least reprojection error over X and Y (Tabb and Ahmad Yousef 2017, rp1), from several starts.

    Raises:
        Refusal: no method gives a start.
        SolverFailure: what is left is not small against the target's own motion in the image.
    """
    recording, noise = one_per_robot_pose(recording), Noise(DEFAULT_NOISE.observed)
    starts = sorted(_starts(recording, problem), key=lambda state: linearise(problem, state, noise).cost)
    if not starts:
        raise Refusal("neither single3d nor shah gives a start on this recording")
    found = [adjust(problem, state, noise) for state in starts[: ADJUSTMENT_STARTS.starts]]
    best = min(found, key=lambda solution: solution.at.cost)
    centres_px = np.nanmean(problem.observed, axis=1)
    left_px = np.linalg.norm(best.at.residuals[problem.seen], axis=1)
    moved_px = np.linalg.norm(centres_px - np.median(centres_px, axis=0), axis=1)
    if share_left(left_px, moved_px) > LARGEST_SHARE:
        raise SolverFailure(
            f"leaves {significant(np.median(left_px), 3)} px in the median where the target moved by "
            f"{significant(np.median(moved_px), 3)}: "
            "are the robot poses inverted, or the mounting wrong?"
        )
    return best


def _starts(recording: Recording, problem: Problem) -> list[State]:
    """X by Single3D and by Shah, each with the Y that most samples agree on and the next different one."""
    candidates, _ = planar_candidates(recording)
    hand = recording.hand_poses()
    usable = np.isfinite(hand).all((1, 2)) & np.isfinite(candidates).all((1, 2, 3))
    states = []
    for first_guess in (_by_single3d, _by_shah):
        try:
            parent_T_camera = first_guess(recording)
        except (Refusal, SolverFailure):
            continue
        seen_as = se3.inverse(hand[usable, None]) @ parent_T_camera @ candidates[usable]
        states += [
            start(problem, parent_T_camera, other) for other in _most_agreed(seen_as.reshape(-1, 4, 4))
        ]
    return [state for state in states if np.isfinite(linearise(problem, state, DEFAULT_NOISE).cost)]


def _by_single3d(recording: Recording) -> Array:
    positions = single3d.marker_positions(recording)
    return positions.rest_given(single3d.iterate(positions)[0])[0]


def _by_shah(recording: Recording) -> Array:
    import cv2

    return robot_world(pose_pairs(recording), cv2.CALIB_ROBOT_WORLD_HAND_EYE_SHAH)[0]


def _most_agreed(poses: Array) -> list[Array]:
    """Of poses (M, 4, 4), the one whose rotation most others share, and the best one unlike it."""
    poses = poses[:: 1 + len(poses) // ADJUSTMENT_STARTS.most_votes]
    angles = se3.rotation_error_rad(poses[:, None], poses)
    loneliness = np.minimum(angles, ADJUSTMENT_STARTS.agreeing_rad).sum(1)
    first = int(loneliness.argmin())
    unlike = np.flatnonzero(angles[first] > ADJUSTMENT_STARTS.agreeing_rad)
    chosen = [first, *unlike[loneliness[unlike].argsort()[:1]]]
    offset = np.median(poses[:, :3, 3], axis=0)
    return [se3.make(poses[i, :3, :3], offset) for i in chosen]


def rms_px(problem: Problem, solution: Solution) -> float:
    """Rms distance between predicted and observed points, px."""
    return float(np.sqrt((solution.at.residuals**2).sum() / problem.seen.sum()))


def to_estimate(problem: Problem, solution: Solution, **extras: object) -> Estimate:
    """The estimate with its evidence."""
    corrections = solution.at.corrections
    diagnostics: dict[str, object] = {
        "samples": len(problem.observed),
        "points": int(problem.seen.sum()),
        "reprojection_rms_px": rms_px(problem, solution),
        "sigma_px": solution.noise.observed,
    }
    if not solution.noise.robot_is_exact:
        diagnostics |= {
            "sigma_robot_rotation_deg": float(np.rad2deg(solution.noise.rotation_rad)),
            "sigma_robot_translation_mm": 1e3 * solution.noise.translation_m,
            "robot_correction_rms_deg": float(np.rad2deg(np.sqrt((corrections[:, :3] ** 2).sum(1).mean()))),
            "robot_correction_rms_mm": float(1e3 * np.sqrt((corrections[:, 3:] ** 2).sum(1).mean())),
            "redundancy": solution.redundancy.tolist(),
        }
    return Estimate(
        solution.state.parent_T_camera,
        solution.state.carrier_T_target,
        covariance=None if solution.noise.robot_is_exact else solution.covariance[:6, :6],
        termination=solution.termination,
        iterations=solution.iterations,
        diagnostics=diagnostics,
        extras=extras,
    )
