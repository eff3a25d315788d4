"""Target poses from corners: both planar solutions, the choice between them, and partial views."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_datasets.suites.synthetic_markers import PRESETS, generate
from hecbench_plugins.markers.target_poses import planar_candidates, project, target_poses

from hecbench import se3
from hecbench.errors import Refusal
from hecbench.recording import CameraModel
from hecbench.targets import PointsTarget


def from_corners(recording):
    return target_poses(replace(recording, camera_T_target=None))


def test_exact_corners_give_exact_poses(exact_rig):
    np.testing.assert_allclose(from_corners(exact_rig), exact_rig.camera_T_target, atol=1e-6)


def test_distortion_is_undone(exact_rig):
    distorted = CameraModel(1280, 960, exact_rig.camera.K, np.array([-0.3, 0.1, 0.001, -0.002, 0.05]))
    points = exact_rig.target.points_m
    corners = np.array([project(distorted, pose, points) for pose in exact_rig.camera_T_target])
    recording = replace(exact_rig, camera=distorted, corners_px=corners)
    np.testing.assert_allclose(from_corners(recording), exact_rig.camera_T_target, atol=1e-5)


def test_non_planar_targets(exact_rig, rng):
    points = rng.uniform(-0.1, 0.1, (9, 3))
    corners = np.array([project(exact_rig.camera, pose, points) for pose in exact_rig.camera_T_target])
    recording = replace(exact_rig, target=PointsTarget.of(points), corners_px=corners)
    np.testing.assert_allclose(from_corners(recording), exact_rig.camera_T_target, atol=1e-6)


def test_partly_seen_targets(exact_rig):
    corners = exact_rig.corners_px.copy()
    corners[0, :20] = np.nan
    corners[1, 3:] = np.nan
    poses = from_corners(replace(exact_rig, corners_px=corners))
    np.testing.assert_allclose(poses[0], exact_rig.camera_T_target[0], atol=1e-6)
    assert np.isnan(poses[1]).all()


def test_collinear_points_are_not_a_pose(exact_rig):
    corners = np.full_like(exact_rig.corners_px, np.nan)
    corners[:, :6] = exact_rig.corners_px[:, :6]
    with pytest.raises(Refusal, match="no sample shows"):
        from_corners(replace(exact_rig, corners_px=corners))


def test_the_hand_motion_resolves_planar_flips():
    """A 5 cm tag at 2 m: the better-reprojecting solution is often wrong, the chosen one rarely."""
    setting = replace(PRESETS["small_tag_2m"], rotation_deg=35.0)
    by_pixels, by_motion, total = 0, 0, 0
    for seed in range(15):
        recording = generate(setting, np.random.default_rng(seed))
        truth = truth_of(setting, seed)
        candidates, errors = planar_candidates(recording)
        assert (errors[:, 0] <= errors[:, 1]).all()
        wrong = lambda poses, truth=truth: (se3.rotation_error_rad(poses, truth) > np.deg2rad(15)).sum()  # noqa: E731
        by_pixels += wrong(candidates[:, 0])
        by_motion += wrong(target_poses(recording))
        total += len(recording)
    assert by_pixels > 0.1 * total
    assert by_motion < 0.3 * by_pixels


def truth_of(setting, seed):
    """The noise-free camera_T_target of the same draws."""
    quiet = replace(setting, pixel_noise_px=0.0, robot_noise_mm=0.0, robot_noise_deg=0.0)
    recording = generate(quiet, np.random.default_rng(seed))
    return target_poses(recording)


def test_without_corners_or_intrinsics_the_reason_is_given(exact_rig):
    blind = replace(exact_rig, camera_T_target=None, camera=CameraModel(1280, 960))
    with pytest.raises(Refusal, match=r"camera.K"):
        target_poses(blind)
