"""`check` names what was misread in generated board recordings, and it alone; standstills and lags."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_datasets.synthetic_misreadings import MISREADINGS, near_board

from hecbench import se3
from hecbench.diagnose import Severity, check
from hecbench.diagnose.clock_lag import interpolated
from hecbench.samples.standstills import one_per_robot_pose, standstills


def critical(recording):
    return {finding.id for finding in check(recording) if finding.severity is Severity.CRITICAL}


@pytest.mark.parametrize("eye_to_hand", [False, True])
def test_silent_on_a_good_board(eye_to_hand):
    assert critical(near_board(np.random.default_rng(1), eye_to_hand=eye_to_hand)) == set()


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("name", MISREADINGS)
def test_the_cause_is_named(name):
    fault = MISREADINGS[name]
    good = near_board(np.random.default_rng(2))
    assert fault.finding in critical(fault.seed(good, np.random.default_rng(3)))


def test_samples_of_one_robot_pose_are_one(rng):
    good, rows = near_board(rng, samples=6), [0, 0, 1, 2, 2, 2, 3, 4, 5]
    corners_px = good.corners_px[rows] + rng.normal(0, 0.1, (9, 54, 2))
    repeated = replace(
        good, sample_ids=tuple("abcdefghi"), corners_px=corners_px, base_T_flange=good.base_T_flange[rows]
    )
    assert standstills(repeated.base_T_flange).tolist() == [0, 0, 1, 2, 2, 2, 3, 4, 5]
    once = one_per_robot_pose(repeated)
    assert once.sample_ids == ("a", "c", "d", "g", "h", "i")
    np.testing.assert_allclose(once.corners_px[2], repeated.corners_px[3:6].mean(0))
    np.testing.assert_allclose(once.base_T_flange, good.base_T_flange, atol=1e-12)


def test_a_frozen_robot_stream_is_not_a_standstill(rng):
    good = near_board(rng, samples=8)
    frozen = replace(good, base_T_flange=good.base_T_flange[[0, 1, 2, 3, 4, 4, 4, 4]])
    assert len(one_per_robot_pose(frozen)) == 8


def test_poses_between_samples(rng):
    poses = se3.exp(rng.normal(0, 0.3, (3, 6)))
    times = np.array([0.0, 1.0, 3.0])
    found = interpolated(times, poses, np.array([-0.1, 0.0, 0.5, 3.0, 3.1]))
    assert np.isnan(found[[0, 4]]).all()
    np.testing.assert_allclose(found[[1, 3]], poses[[0, 2]], atol=1e-12)
    half = se3.log(se3.inverse(poses[0]) @ found[2])
    np.testing.assert_allclose(2 * half, se3.log(se3.inverse(poses[0]) @ poses[1]), atol=1e-9)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("zero", ["base_T_flange", "camera_T_target"])
def test_translations_of_zero_warn_nobody(zero, exact_rig):
    poses = getattr(exact_rig, zero).copy()
    poses[:, :3, 3] = 0
    bare = replace(
        exact_rig, corners_px=None, images=None, joints_rad=None, robot=None, target=None, camera=None
    )
    findings = {finding.id: finding for finding in check(replace(bare, **{zero: poses}))}
    if zero == "camera_T_target":
        assert "rotations only" in findings["camera_frame"].summary
    assert any(finding.severity is Severity.CRITICAL for finding in findings.values())
