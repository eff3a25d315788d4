"""Reprojection bundle adjustment: planar flips, covariance, intrinsics, and the real arm."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_datasets.suites.synthetic_markers import PRESETS, generate, make
from hecbench_plugins.markers.reprojection import corner_problem
from hecbench_plugins.solvers.bundle import Bundle, IntrinsicsPrior
from hecbench_plugins.solvers.bundle_fixed import bundle_fixed

from hecbench import se3
from hecbench.conformance import rig
from hecbench.errors import Refusal, SolverFailure
from hecbench.recording import Mounting
from hecbench.storage import recording_io
from hecbench.targets import ChessboardTarget

KNOWN = {"tag_2m": Bundle(0.3, 0.05, 0.5), "tag_2m_in_hand": Bundle(0.3, 0.05, 0.5)}


def solved(solver, recording):
    return solver(recording.without_truth(), rng=np.random.default_rng(0))


def errors(estimate, recording):
    X = recording.truth_parent_T_camera
    return (
        float(se3.translation_error_m(estimate.parent_T_camera, X)),
        float(se3.rotation_error_rad(estimate.parent_T_camera, X)),
    )


@pytest.mark.parametrize("level", KNOWN)
def test_covariance_is_calibrated(level):
    """e^T C^-1 e of 25 rigs: chi-square with 6 degrees of freedom, whose mean over 25 has sigma 0.7."""
    squares = []
    for index in range(25):
        recording = make(level, index, 5)
        found = solved(KNOWN[level], recording)
        twist = se3.log(recording.truth_parent_T_camera @ se3.inverse(found.parent_T_camera))
        squares.append(twist @ np.linalg.solve(found.covariance, twist))
    assert np.mean(squares) == pytest.approx(6.0, abs=2.1)


def test_corrections_pay():
    """On boards the robot's errors dominate: correcting them beats taking the robot as exact."""
    with_corrections, without = [], []
    for index in range(6):
        recording = make("board_2m_in_hand", index, 2)
        with_corrections.append(errors(solved(Bundle(), recording), recording)[0])
        without.append(errors(solved(bundle_fixed, recording), recording)[0])
    assert np.median(with_corrections) < 0.7 * np.median(without)


def test_small_frontal_tags_are_not_flipped():
    """Whatever PnP made of them, the corners decide."""
    found = [
        errors(solved(Bundle(), make("small_tag_2m", i, 2)), make("small_tag_2m", i, 2)) for i in range(5)
    ]
    assert np.array(found)[:, 1].max() < np.deg2rad(2.0)


def test_partly_seen_targets(rng):
    recording = rig(rng, Mounting.EYE_TO_HAND)
    corners = recording.corners_px.copy()
    corners[rng.random(corners.shape[:2]) < 0.4] = np.nan
    corners[3] = np.nan
    partial = replace(recording, corners_px=corners, camera_T_target=None)
    for solver in (bundle_fixed, Bundle()):
        assert max(errors(solved(solver, partial), recording)) < 1e-6


def test_an_outlier_robot_pose_hardly_matters():
    recording = make("tag_2m", 1, 2)
    poses = recording.base_T_flange.copy()
    poses[3, :3, 3] += [0.02, -0.02, 0.03]
    spoilt = replace(recording, base_T_flange=poses)
    assert errors(solved(KNOWN["tag_2m"], spoilt), recording)[0] < 0.015
    assert errors(solved(bundle_fixed, spoilt), recording)[0] < 0.05


def wide_angle_recording():
    setting = replace(
        PRESETS["board_2m"],
        target=ChessboardTarget(9, 6, 0.05),
        samples=20,
        distance_m=1.2,
        pixel_noise_px=0.1,
    )
    return generate(setting, np.random.default_rng(4))


def test_intrinsics_are_corrected_within_their_prior():
    recording = wide_angle_recording()
    wrong = recording.camera.K.copy()
    wrong[0, 0] *= 1.01
    wrong[1, 1] *= 1.01
    spoilt = replace(recording, camera=replace(recording.camera, K=wrong))
    found = solved(Bundle(intrinsics=IntrinsicsPrior()), spoilt)
    assert found.camera.K[0, 0] == pytest.approx(recording.camera.K[0, 0], rel=2e-3)
    assert found.extras["K"][0][0] == found.camera.K[0, 0]
    assert errors(found, recording)[0] < 0.3 * errors(solved(Bundle(), spoilt), recording)[0]
    tight = IntrinsicsPrior(1e-6, 1e-6, 1e-6)
    kept = solved(Bundle(intrinsics=tight), spoilt)
    assert kept.camera.K[0, 0] == pytest.approx(wrong[0, 0], rel=1e-4)


def test_evidence(exact_rig):
    found = solved(Bundle(), exact_rig)
    assert found.diagnostics["reprojection_rms_px"] < 1e-6
    assert found.diagnostics["robot_correction_rms_mm"] < 1e-6
    assert found.diagnostics["samples"] == len(exact_rig)
    np.testing.assert_allclose(found.covariance, found.covariance.T, atol=1e-15)
    assert (np.linalg.eigvalsh(found.covariance) > 0).all()
    assert solved(bundle_fixed, exact_rig).covariance is None


def test_inverted_poses_fail(exact_rig):
    turned = replace(exact_rig, base_T_flange=se3.inverse(exact_rig.base_T_flange))
    for solver in (bundle_fixed, Bundle()):
        with pytest.raises((SolverFailure, Refusal)):
            solved(solver, turned)


def test_without_corners_it_refuses(exact_rig):
    with pytest.raises(Refusal, match="corners_px"):
        corner_problem(replace(exact_rig, corners_px=None))


def test_real_arm(shared):
    """The truth of this set is the model of `bundle_fixed` (its README)."""
    recording = recording_io.load(shared / "data/ur3e_cam1")
    metres, radians = errors(solved(bundle_fixed, recording), recording)
    assert metres < 0.002
    assert radians < np.deg2rad(0.1)
    corrected = solved(Bundle(), recording)
    assert errors(corrected, recording)[0] < 0.01
    assert corrected.diagnostics["reprojection_rms_px"] < 0.57
